//! A schedule that is commanded while samples are recorded.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use clap::Args;
use host_sim::link::heartbeat;
use link::{Desired, Request};
use simulation::bad_input;
use simulation::bad_input::number;
use simulation::record::{MEASURED, Record};
use simulation::schedule::{Between, Reader, Schedule};

use super::session::Session;
use crate::commands::choice::{BETWEEN, one_of};

/// Longest accepted input, in s; much more cannot be expressed as a [`Duration`].
const LONGEST_S: f64 = 1e9;

/// The schedule as options.
#[derive(Args, Debug)]
pub(super) struct ScheduleArguments {
    /// Command an armed MCU through the report's stair, its ideal steps, or a file with columns time_s,voltage_v, of at most
    /// 1 000 000 rows and 512 MiB, that lasts at most 1e9 s
    #[arg(long, value_name = "stair|step|FILE.csv")]
    pub(super) input: Option<String>,
    /// Interpolation of the voltage between two rows of an input file
    #[arg(long, default_value = "hold", value_parser = one_of(BETWEEN))]
    between: Between,
}

impl ScheduleArguments {
    /// The schedule; `None` without `--input`.
    pub(super) fn read(&self) -> Result<Option<Schedule>> {
        self.input.as_deref().map(|input| schedule(input, self.between)).transpose()
    }
}

/// Reads `--input`: the report's stair, its ideal steps, or a file.
pub(crate) fn schedule(input: &str, between: Between) -> Result<Schedule> {
    Ok(match input {
        "stair" => Schedule::stair(),
        "step" => Schedule::ideal_stair(),
        file => {
            let schedule = Schedule::from_record(&Record::open(Path::new(file), MEASURED)?, between);
            let length_s = schedule.end_s() - schedule.start_s();
            if length_s > LONGEST_S {
                bad_input!("{file} lasts {} s; expected at most {LONGEST_S} s", number(length_s));
            }
            schedule
        }
    })
}

/// Checks the schedule called `name` before anything is armed or written.
pub(super) fn check_schedule(session: &Session, schedule: &Schedule, name: &str, arm: bool) -> Result<()> {
    if !arm && session.status.sample.state != link::State::Armed {
        bail!("{}: not armed ({}); expected --arm with --input", session.client.name(), session.status.sample.state);
    }
    schedule.check_range(name, session.status.lowest.to_f64(), session.status.highest.to_f64())
}

/// Commands a schedule and keeps the host heard.
pub(super) struct Drive<'a> {
    /// Time at which the schedule starts.
    pub(super) start: Instant,
    /// First time of the schedule, in s, and its voltage.
    reader: Option<(f64, Reader<'a>)>,
    heartbeat: Duration,
    /// The last commanded voltage.
    commanded: Option<f64>,
    /// When this program last began to send a request.
    heard: Instant,
}

impl<'a> Drive<'a> {
    /// Starts now.
    pub(super) fn new(session: &Session, schedule: Option<&'a Schedule>) -> Self {
        let start = Instant::now();
        let reader = schedule.map(|schedule| (schedule.start_s(), schedule.reader()));
        Self { start, reader, heartbeat: heartbeat(&session.status), commanded: None, heard: start }
    }

    /// Commands the voltage of this moment if it has changed, or sends a heartbeat if one is due.
    pub(super) fn step(&mut self, session: &mut Session) -> Result<()> {
        if let Some((from, reader)) = &mut self.reader {
            let volts = reader.at(*from + self.start.elapsed().as_secs_f64());
            if self.commanded != Some(volts) {
                (self.commanded, self.heard) = (Some(volts), Instant::now());
                session.order(Request::Set(Desired::ScaledVolts(volts)))?;
            }
        }
        if self.heard.elapsed() >= self.heartbeat {
            self.heard = Instant::now();
            let (state, _) = session.order(Request::Heartbeat)?;
            if self.reader.is_some() {
                session.still_armed(state)?;
            }
        }
        Ok(())
    }
}
