//! `vsj link PORT record`: writes telemetry to a file, and optionally commands a schedule.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;
use host_sim::link::IsolationRow;
use host_sim::output::recording::{Every, Recording};
use host_sim::output::terminal::{print, remark};
use indicatif::{ProgressBar, ProgressStyle};
use link::Request;
use model::isolation::Verdict;
use serde_json::json;
use simulation::bad_input;
use simulation::schedule::Schedule;

use super::schedule::{Drive, ScheduleArguments, check_schedule};
use super::session::{Session, seconds, stopped};

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
    #[command(flatten)]
    schedule: ScheduleArguments,
    /// Arm the MCU first
    #[arg(long)]
    arm: bool,
    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
}

impl Arguments {
    pub(super) fn check(&self) -> Result<()> {
        self.schedule.read()?;
        self.time().map(drop)
    }

    fn time(&self) -> Result<Option<Duration>> {
        rows_hz(self.rate_hz)?;
        self.seconds.map(|time| seconds("--seconds", time, f64::INFINITY)).transpose()
    }
}

/// Checks `--rate-hz`, rows per second.
pub(crate) fn rows_hz(rate_hz: f64) -> Result<f64> {
    if !(0.02..=10_000.0).contains(&rate_hz) {
        bad_input!("--rate-hz {rate_hz}: expected 0.02 to 10000");
    }
    Ok(rate_hz)
}

pub(super) fn run(session: &mut Session, arguments: &Arguments, baud: u32) -> Result<()> {
    let schedule = arguments.schedule.read()?;
    if let (Some(schedule), Some(name)) = (&schedule, &arguments.schedule.input) {
        check_schedule(session, schedule, name, arguments.arm)?;
    }
    let length = schedule.as_ref().map(|schedule| Duration::from_secs_f64(schedule.end_s() - schedule.start_s()));
    let whole = arguments.time()?.or(length);
    let every = Every::at(arguments.rate_hz, session.status.rate_hz, baud);
    let mut recording = Recording::new(&arguments.file, arguments.force, &session.status, every)?;
    if arguments.arm {
        session.order(Request::Arm)?;
    }
    let was_armed = arguments.arm || session.status.sample.state == link::State::Armed;
    session.order(Request::Stream { every_ticks: every.sample_ticks })?;
    let mut verdicts = Vec::new();
    let done = follow(session, schedule.as_ref(), whole, &mut recording, &mut verdicts);
    // The MCU would also stop by itself once the host is silent.
    let ended = session.order(Request::Stream { every_ticks: 0 });
    let finished = recording.finish();
    let (summary, file) = (recording.summary(), arguments.file.display());
    done.with_context(|| format!("{file} contains {} rows", summary.rows))?;
    finished?;
    ended?;
    summary.remarks(&file.to_string()).iter().for_each(|text| remark(text));
    if session.json {
        let mut report = serde_json::to_value(summary)?;
        report["file"] = json!(arguments.file);
        report["isolation"] = json!(verdicts);
        print(&format!("{report}\n"))?;
    } else {
        print(&format!("wrote {file}: {} rows, {} s, {} samples lost\n", summary.rows, summary.seconds, summary.lost))?;
    }
    // After a signal nothing waits for another answer; the fault was named when it came.
    if was_armed && !stopped() { session.not_faulted() } else { Ok(()) }
}

/// Records, names the faults that the MCU reports as they come, and collects what the isolation bank says first and at each change of its
/// verdict.
fn follow(
    session: &mut Session,
    schedule: Option<&Schedule>,
    whole: Option<Duration>,
    recording: &mut Recording,
    verdicts: &mut Vec<IsolationRow>,
) -> Result<()> {
    let name = session.client.name().to_owned();
    let bar = match whole {
        Some(time) if time < Duration::from_secs(1 << 30) => ProgressBar::new(time.as_secs()),
        _ => ProgressBar::no_length(),
    };
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos} of {len} s, {msg}")?);
    let whole = whole.unwrap_or(Duration::MAX);
    let (mut drive, mut last) = (Drive::new(session, schedule), None);
    let start = drive.start;
    while start.elapsed() < whole && !stopped() {
        drive.step(session)?;
        let wait = Duration::from_millis(5).min(whole.saturating_sub(start.elapsed()));
        for sample in session.client.samples(wait).with_context(|| name.clone())? {
            recording.add(&sample)?;
        }
        session.reports().for_each(|report| bar.suspend(|| remark(&report)));
        let report = session.client.verdict();
        let verdict = report.map(|report| report.verdict);
        if let Some(report) = report.filter(|_| verdict != last) {
            let row = IsolationRow::new(&report, session.status.rate_hz);
            if last.is_some() || report.verdict().is_some_and(|says| says != Verdict::Quiet) {
                bar.suspend(|| remark(&format!("{name}: isolation {}", row.text())));
            }
            verdicts.push(row);
            last = verdict;
        }
        bar.set_position(start.elapsed().as_secs());
        bar.set_message(format!("{} rows", recording.summary().rows));
    }
    bar.finish_and_clear();
    Ok(())
}
