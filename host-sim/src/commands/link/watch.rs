//! `vsj link PORT watch`: the loop while it runs.
//!
//! On a terminal one screenful is written over and over; anywhere else each sample is a line.

use std::io::{self, ErrorKind, IsTerminal, Write};
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use host_sim::link::{Row, StatusReport};
use serde::Serialize;

use super::{Talk, seconds, stop_on_interrupt, stopped};

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Time between two samples, in s
    #[arg(long, default_value_t = 0.2, value_name = "S", allow_negative_numbers = true)]
    every: f64,
    /// Stop after so many seconds; without it, with Ctrl-C
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

/// What `--json` prints at the end.
#[derive(Serialize)]
struct Watched {
    samples: u64,
    seconds: f64,
    status: StatusReport,
}

pub(super) fn run(talk: &mut Talk, arguments: &Arguments) -> Result<()> {
    let (every, whole) = arguments.times()?;
    stop_on_interrupt()?;
    let mut screen = Screen::new(talk.json);
    let (start, heartbeat) = (Instant::now(), talk.heartbeat());
    let (mut samples, mut next) = (0, start);
    let mut report = StatusReport::new(&talk.status);
    while start.elapsed() < whole && !stopped() {
        report = StatusReport::new(&talk.refresh()?);
        if Instant::now() >= next {
            samples += 1;
            match screen.show(&report) {
                // Who closes the pipe has seen enough.
                Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(()),
                shown => shown?,
            }
            // From now on, should we have been late: no burst.
            next = (next + every).max(Instant::now());
        }
        let pause = next.saturating_duration_since(Instant::now());
        std::thread::sleep(pause.min(heartbeat).min(whole.saturating_sub(start.elapsed())));
    }
    if talk.json {
        let watched = Watched { samples, seconds: start.elapsed().as_secs_f64(), status: report };
        println!("{}", serde_json::to_string(&watched)?);
    }
    Ok(())
}

/// Where samples go.
struct Screen {
    out: Box<dyn Write>,
    /// Written over, instead of line by line.
    live: bool,
    lines: usize,
}

impl Screen {
    fn new(json: bool) -> Self {
        // With --json, stdout is for the one object.
        let (out, live): (Box<dyn Write>, _) = if json {
            (Box::new(io::stderr()), io::stderr().is_terminal())
        } else {
            (Box::new(io::stdout()), io::stdout().is_terminal())
        };
        Self { out, live, lines: 0 }
    }

    fn show(&mut self, report: &StatusReport) -> io::Result<()> {
        let mut text = String::new();
        if self.live {
            if self.lines > 0 {
                // Up to where the last one started.
                text += &format!("\x1b[{}A", self.lines);
            }
            for line in report.text().lines() {
                // Each line clears what stood to its right.
                text += &format!("{line}\x1b[K\n");
            }
            self.lines = report.text().lines().count();
        } else {
            if self.lines == 0 {
                text += &format!("{}\n", Row::HEADER);
            }
            text += &format!("{}\n", report.sample.line());
            self.lines += 1;
        }
        self.out.write_all(text.as_bytes())?;
        self.out.flush()
    }
}
