//! `vsj link PORT record`: writes telemetry to a file, and optionally commands a schedule.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;
use host_sim::link::heartbeat;
use host_sim::output::recording::{Every, Recording};
use host_sim::output::terminal::{print, remark};
use indicatif::{ProgressBar, ProgressStyle};
use link::{Desired, Request};
use serde_json::json;
use simulation::bad_input;
use simulation::bad_input::number;
use simulation::record::{MEASURED, Record};
use simulation::schedule::{Between, Reader, Schedule};

use super::session::{Session, seconds, stop_on_interrupt, stopped};
use crate::commands::choice::{BETWEEN, one_of};

/// Longest accepted input, in s; much more cannot be expressed as a [`Duration`].
const LONGEST_S: f64 = 1e9;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// The file to write: MCAP or Parquet if its name ends in .mcap or .parquet, otherwise CSV
    #[arg(value_name = "FILE.csv")]
    file: PathBuf,
    /// Stop after this many seconds; default: at the end of --input, or with Ctrl-C
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Rows per second; 115 200 bit/s suffice for about 250. Where the voltage turns between two rows, a further one is
    /// written
    #[arg(long, default_value_t = 100.0, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: f64,
    /// Command an armed MCU through the report's stair, its ideal steps, or a file with columns time_s,voltage_v that
    /// lasts at most 1e9 s
    #[arg(long, value_name = "stair|step|FILE.csv")]
    input: Option<String>,
    /// Interpolation of the voltage between two rows of an input file
    #[arg(long, default_value = "hold", value_parser = one_of(BETWEEN))]
    between: Between,
    /// Arm the MCU first
    #[arg(long)]
    arm: bool,
    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
}

impl Arguments {
    pub(super) fn check(&self) -> Result<()> {
        self.schedule()?;
        self.time().map(drop)
    }

    fn time(&self) -> Result<Option<Duration>> {
        rows_hz(self.rate_hz)?;
        self.seconds.map(|time| seconds("--seconds", time, f64::INFINITY)).transpose()
    }

    fn schedule(&self) -> Result<Option<Schedule>> {
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

/// Checks `--rate-hz`, rows per second.
pub(crate) fn rows_hz(rate_hz: f64) -> Result<f64> {
    if !(0.02..=10_000.0).contains(&rate_hz) {
        bad_input!("--rate-hz {rate_hz}: expected 0.02 to 10000");
    }
    Ok(rate_hz)
}

pub(super) fn run(session: &mut Session, arguments: &Arguments, baud: u32) -> Result<()> {
    let schedule = arguments.schedule()?;
    if let (Some(schedule), Some(name)) = (&schedule, &arguments.input) {
        check_schedule(session, schedule, name, arguments.arm)?;
    }
    let length = schedule.as_ref().map(|schedule| Duration::from_secs_f64(schedule.end_s() - schedule.start_s()));
    let whole = arguments.time()?.or(length);
    stop_on_interrupt();
    let every = Every::at(arguments.rate_hz, session.status.rate_hz, baud);
    let mut recording = Recording::new(&arguments.file, arguments.force, &session.status, every)?;
    if arguments.arm {
        session.order(Request::Arm)?;
    }
    session.order(Request::Stream { every_ticks: every.sample_ticks })?;
    let done = follow(session, schedule.as_ref(), whole, &mut recording);
    // The MCU would also stop by itself once the host is silent.
    let stopped = session.order(Request::Stream { every_ticks: 0 });
    let finished = recording.finish();
    let (summary, file) = (recording.summary(), arguments.file.display());
    done.with_context(|| format!("{file} contains {} rows", summary.rows))?;
    finished?;
    stopped?;
    summary.remarks(&file.to_string()).iter().for_each(|text| remark(text));
    if session.json {
        let mut report = serde_json::to_value(summary)?;
        report["file"] = json!(arguments.file);
        print(&format!("{report}\n"))
    } else {
        print(&format!("wrote {file}: {} rows, {} s, {} lost\n", summary.rows, summary.seconds, summary.lost))
    }
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
    start: Instant,
    /// First time of the schedule, in s, and its voltage.
    reader: Option<(f64, Reader<'a>)>,
    heartbeat: Duration,
    /// The last commanded voltage.
    commanded: Option<f64>,
    /// When the MCU last heard from this program.
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
                session.order(Request::Set(Desired::ScaledVolts(volts)))?;
                (self.commanded, self.heard) = (Some(volts), Instant::now());
            }
        }
        if self.heard.elapsed() >= self.heartbeat {
            let (state, _) = session.order(Request::Heartbeat)?;
            if self.reader.is_some() {
                session.still_armed(state)?;
            }
            self.heard = Instant::now();
        }
        Ok(())
    }
}

fn follow(
    session: &mut Session,
    schedule: Option<&Schedule>,
    whole: Option<Duration>,
    recording: &mut Recording,
) -> Result<()> {
    let name = session.client.name().to_owned();
    let bar = match whole {
        Some(time) if time < Duration::from_secs(1 << 30) => ProgressBar::new(time.as_secs()),
        _ => ProgressBar::no_length(),
    };
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos} of {len} s, {msg}")?);
    let whole = whole.unwrap_or(Duration::MAX);
    let mut drive = Drive::new(session, schedule);
    let start = drive.start;
    while start.elapsed() < whole && !stopped() {
        drive.step(session)?;
        let wait = Duration::from_millis(5).min(whole.saturating_sub(start.elapsed()));
        for sample in session.client.samples(wait).with_context(|| name.clone())? {
            recording.add(&sample)?;
        }
        bar.set_position(start.elapsed().as_secs());
        bar.set_message(format!("{} rows", recording.summary().rows));
    }
    bar.finish_and_clear();
    Ok(())
}
