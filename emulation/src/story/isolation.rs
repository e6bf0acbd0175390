//! The demonstration of the isolation bank: the board drives a spring that changes, or whose sensor gets stuck, and names the cause
//! in its log. The host says the same of the same ticks, and `vsj isolate` of the record of them, bit for bit; the output is that of
//! a host without a bank.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use firmware::isolation::{Isolation, Terms};
use firmware::settings::built_in;
use link::IsolationReport;
use rayon::prelude::*;
use serde_json::Value;
use test_bench::script::Script;
use test_bench::simulation::simulate_with;
use xtask::build::{self, Board};
use xtask::shell;
use xtask::variant::{Controller, Variant};

use super::lock_step::{Disturbance, Moment, TICK_S};
use super::sensor::sensing;
use super::stage::Stage;
use crate::binary::{audit, size};

/// What happens, under a name, and what the bank has to name at the end.
const CASES: [(&str, Disturbance, Option<&str>); 3] = [
    ("healthy", Disturbance::None, None),
    ("gain +10 % from 20 s", Disturbance::Gain(20_000, 1.1), Some("gain-error")),
    ("sensor stuck from 44 s", Disturbance::Stuck(44_000), Some("stuck-sensor")),
];

/// A change of the verdict.
#[derive(Clone, Debug, PartialEq)]
struct Said {
    tick: u32,
    since_tick: u32,
    verdict: String,
    cause: Option<Cause>,
}

/// The cause that explains most.
#[derive(Clone, Debug, PartialEq)]
struct Cause {
    name: String,
    /// Size of the cause, as the bank states it.
    size: f64,
    /// Upper end of the interval of the size.
    high: f64,
    explained: f64,
}

/// Builds the image with the bank, whose tick cannot panic and which keeps the bounds of its size.
pub(super) fn stage() -> Result<Stage> {
    let stage = Stage::new(Controller::Paper, size::ISOLATION)?;
    audit::with_isolation(&build::read(&stage.elf)?)?;
    let size = size::measure(Variant::of(Controller::Paper), size::ISOLATION, Board::Mps2)?;
    size.check()?;
    eprintln!("with the isolation bank: {size}");
    Ok(stage)
}

/// Runs every case and prints what was said, a line each.
pub(super) fn check(stage: &Stage) -> Result<()> {
    let vsj = build::vsj()?;
    let run = |(name, disturbance, named): &(&str, Disturbance, Option<&str>)| {
        one(stage, &vsj, name, disturbance, *named).with_context(|| (*name).to_owned())
    };
    let lines: Vec<String> = CASES.par_iter().map(run).collect::<Result<_>>()?;
    lines.iter().for_each(|line| println!("{line}"));
    println!("each as the host and vsj isolate, bit for bit, with the codes of a host without the bank");
    Ok(())
}

fn one(stage: &Stage, vsj: &Path, name: &str, disturbance: &Disturbance, named: Option<&str>) -> Result<String> {
    let run = sensing(stage);
    let folder = stage.folder(&name.replace([' ', '%'], "-"))?;
    let pass = stage.drive(&run, &folder, stage.spring(None, 1), disturbance, None)?;
    let board: Vec<Said> = pass.said("isolation").iter().map(|line| logged(line)).collect::<Result<_>>()?;
    let (host, record) = on_the_host(&run, &pass.moments, &folder)?;
    ensure!(board == host, "the board says {board:?}, the host {host:?}");
    let isolated = isolated(vsj, &record)?;
    ensure!(board == isolated, "the board says {board:?}, vsj isolate {isolated:?}");
    let names: Vec<&str> = board
        .iter()
        .filter(|said| said.verdict == "named")
        .filter_map(|said| Some(said.cause.as_ref()?.name.as_str()))
        .collect();
    match named {
        None => ensure!(board.is_empty(), "{board:?}"),
        Some(named) => ensure!(!names.is_empty() && names.iter().all(|name| *name == named), "{board:?}"),
    }
    let says = board.iter().map(describe).collect::<Vec<_>>();
    let says = if says.is_empty() { "nothing is said".to_owned() } else { says.join(", ") };
    Ok(format!("{name}: {says}"))
}

/// A change of the verdict for people.
fn describe(Said { tick, since_tick, verdict, cause }: &Said) -> String {
    let [at_s, since_s] = [tick, since_tick].map(|tick| f64::from(*tick) * TICK_S);
    match cause {
        None => format!("{verdict} at {at_s:.1} s"),
        Some(Cause { name, size, high, .. }) => {
            let half_width = high - size;
            format!("{verdict} {name} at {at_s:.1} s ({size:.5} +- {half_width:.5} since {since_s:.2} s)")
        }
    }
}

/// The change of the verdict in a line of the log, without its first word.
fn logged(line: &str) -> Result<Said> {
    let text = |key: &str| line.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
    let number = |key: &str| -> Result<f64> {
        text(key).and_then(|text| text.parse().ok()).with_context(|| format!("no {key} in `{line}`"))
    };
    let cause = match (text("cause"), text("size")) {
        (Some(name), Some(_)) => {
            let (size, half_width, explained) = (number("size")?, number("half_width")?, number("explained")?);
            Some(Cause { name: name.to_owned(), size, high: size + half_width, explained })
        }
        // A name that is withdrawn has no size any more.
        _ => None,
    };
    let verdict = text("verdict").or(line.split(' ').next()).unwrap_or_default().to_owned();
    Ok(Said { tick: number("tick")? as u32, since_tick: number("since_tick")? as u32, verdict, cause })
}

/// What the host says of the same ticks, and the path of a record of them.
fn on_the_host(run: &str, moments: &[Moment], folder: &Path) -> Result<(Vec<Said>, PathBuf)> {
    let script = Script::parse(run).context("no such run")?;
    let settings = built_in(*script.settings());
    let terms = Terms::new(&settings, Some(settings.control.plant), settings.control.amplifier.max_v);
    let mut isolation = Box::new(Isolation::off());
    isolation.start(&terms);
    let (mut said, mut text) = (Vec::new(), String::from("time_s,voltage_v,stiffness\n"));
    let mut tick = 0u32;
    let received = |tick: u32| moments.get(tick.checked_sub(1)? as usize)?.received;
    simulate_with(script, None, received, |control, done| {
        let read = received(tick + 1).map_or("-".to_owned(), |volts| volts.to_f64().to_string());
        let _ =
            writeln!(text, "{},{},{read}", f64::from(tick) / settings.control.rate_hz, done.output.applied.to_f64());
        tick += 1;
        if let Some(news) = isolation.tick(control, done)
            && news.report.verdict != news.before
        {
            let IsolationReport { size, half_width, explained, .. } = terms.describe(&news.report, 0, 0);
            let name = news.report.verdict.causes().0.map(|cause| cause.name().to_owned());
            said.push(Said {
                tick,
                since_tick: news.since_tick(tick.into()) as u32,
                verdict: news.report.verdict.name().to_owned(),
                cause: name.map(|name| Cause { name, size, high: size + half_width, explained }),
            });
        }
    })?;
    let path = folder.join("record.csv");
    fs::write(&path, text)?;
    Ok((said, path))
}

/// What `vsj isolate` says of a record, in the ticks of the board: a reading is sampled after the tick whose voltage it belongs to.
fn isolated(vsj: &Path, record: &Path) -> Result<Vec<Said>> {
    let mut command = shell::command(vsj);
    let report = shell::json(command.arg("isolate").arg(record).args(["--noise-v", "1", "--json"]))?;
    let events = report["trace"].as_array().context("no trace")?;
    let said = |event: &Value| {
        let number = |value: &Value| value.as_f64().with_context(|| format!("a number is missing in {event}"));
        let tick = |value: &Value| anyhow::Ok((number(value)? / TICK_S).round() as u32 + 1);
        let word = |key: &str| event[key].as_str().map(str::to_owned);
        let (size, high) = (&event["size"]["value"], &event["size"]["high"]);
        let cause = |name| {
            anyhow::Ok(Cause {
                name,
                size: number(size)?,
                high: number(high)?,
                explained: number(&event["explained"])?,
            })
        };
        anyhow::Ok(Said {
            tick: tick(&event["time_s"])?,
            since_tick: tick(&event["since_s"])?,
            verdict: word("verdict").context("no verdict")?,
            cause: word("cause").map(cause).transpose()?,
        })
    };
    // The first one is that of the first row.
    events.iter().skip(1).map(said).collect()
}
