//! `vsj link PORT watch`: the loop while it runs.
//!
//! On a terminal one screenful is written over and over; anywhere else each sample is a line.

use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use host_sim::link::{StatusReport, heartbeat};
use host_sim::output::screen::Screen;
use host_sim::output::terminal::{json, print};
use serde::Serialize;

use super::session::{Session, seconds, stop_on_interrupt, stopped};

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Time between two samples, in s
    #[arg(long, default_value_t = 0.2, value_name = "S", allow_negative_numbers = true)]
    every: f64,
    /// Stop after this many seconds; default: with Ctrl-C
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
}

impl Arguments {
    pub(super) fn check(&self) -> Result<()> {
        self.times().map(drop)
    }

    fn times(&self) -> Result<(Duration, Duration)> {
        let whole = self.seconds.map_or(Ok(Duration::MAX), |time| seconds("--seconds", time, f64::INFINITY))?;
        Ok((seconds("--every", self.every, 3600.0)?, whole))
    }
}

/// The answer of `watch` with `--json`.
#[derive(Serialize)]
struct Watched {
    samples: u64,
    seconds: f64,
    status: StatusReport,
}

pub(super) fn run(session: &mut Session, arguments: &Arguments) -> Result<()> {
    let (every, whole) = arguments.times()?;
    stop_on_interrupt();
    let mut screen = Screen::new(session.json);
    let (start, heartbeat) = (Instant::now(), heartbeat(&session.status));
    let (mut samples, mut next) = (0, start);
    let mut report = session.report()?;
    while start.elapsed() < whole && !stopped() {
        session.refresh()?;
        report = session.report()?;
        if Instant::now() >= next {
            samples += 1;
            if !screen.show(&report)? {
                return Ok(());
            }
            // After a delay, continue from now instead of catching up.
            next = (next + every).max(Instant::now());
        }
        let pause = next.saturating_duration_since(Instant::now());
        std::thread::sleep(pause.min(heartbeat).min(whole.saturating_sub(start.elapsed())));
    }
    if session.json {
        let watched = Watched { samples, seconds: start.elapsed().as_secs_f64(), status: report };
        print(&json(&watched)?)?;
    }
    Ok(())
}
