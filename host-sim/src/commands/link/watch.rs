//! `vsj link PORT watch`: the loop while it runs.
//!
//! On a terminal one screenful is written over and over; anywhere else each sample is a line. With `--udp` every sample that
//! arrives is a datagram too.

use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::Args;
use host_sim::link::{StatusReport, heartbeat};
use host_sim::output::recording::Every;
use host_sim::output::screen::Screen;
use host_sim::output::terminal::{json, print};
use host_sim::output::udp::{Datagrams, PLOT_JUGGLER};
use link::Request;
use serde::Serialize;

use super::record::rows_hz;
use super::session::{Session, seconds, stopped};

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Time between two samples, in s
    #[arg(long, default_value_t = 0.2, value_name = "S", allow_negative_numbers = true)]
    every: f64,
    /// Stop after this many seconds; default: with Ctrl-C
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Send samples as JSON to PlotJuggler's UDP server too, whether or not it listens; without a value to 127.0.0.1:9870
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = PLOT_JUGGLER)]
    udp: Option<String>,
    /// Samples per second for --udp; 115 200 bit/s suffice for about 250
    #[arg(long, default_value_t = 100.0, value_name = "HZ", allow_negative_numbers = true, requires = "udp")]
    rate_hz: f64,
}

impl Arguments {
    pub(super) fn check(&self) -> Result<()> {
        rows_hz(self.rate_hz)?;
        self.udp.as_deref().map(|address| Datagrams::to(address, 1)).transpose()?;
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
    /// Number of datagrams, only with `--udp`.
    #[serde(skip_serializing_if = "Option::is_none")]
    datagrams: Option<u64>,
    status: StatusReport,
}

pub(super) fn run(session: &mut Session, arguments: &Arguments, baud: u32) -> Result<()> {
    let (every, whole) = arguments.times()?;
    let rate_hz = session.status.rate_hz;
    let mut datagrams = arguments.udp.as_deref().map(|address| Datagrams::to(address, rate_hz)).transpose()?;
    if datagrams.is_some() {
        let Every { row_ticks, .. } = Every::at(arguments.rate_hz, rate_hz, baud);
        session.order(Request::Stream { every_ticks: row_ticks })?;
    }
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
                break;
            }
            // After a delay, continue from now instead of catching up.
            next = (next + every).max(Instant::now());
        }
        let pause = next.saturating_duration_since(Instant::now());
        let pause = pause.min(heartbeat).min(whole.saturating_sub(start.elapsed()));
        match &mut datagrams {
            Some(datagrams) => forward(session, datagrams, pause)?,
            None => std::thread::sleep(pause),
        }
    }
    if datagrams.is_some() {
        // The MCU would also stop by itself once the host is silent.
        session.order(Request::Stream { every_ticks: 0 })?;
    }
    if session.json {
        let datagrams = datagrams.map(|datagrams| datagrams.sent);
        let watched = Watched { samples, seconds: start.elapsed().as_secs_f64(), datagrams, status: report };
        print(&json(&watched)?)?;
    }
    Ok(())
}

/// Sends on the samples that arrive within `time`, as they come.
fn forward(session: &mut Session, datagrams: &mut Datagrams, time: Duration) -> Result<()> {
    let name = session.client.name().to_owned();
    let until = Instant::now() + time;
    loop {
        let wait = until.saturating_duration_since(Instant::now()).min(Duration::from_millis(5));
        let samples: Vec<_> = session.client.samples(wait).with_context(|| name.clone())?.collect();
        let verdict = session.client.verdict();
        samples.iter().for_each(|sample| datagrams.send(sample, verdict.as_ref()));
        if Instant::now() >= until {
            return Ok(());
        }
    }
}
