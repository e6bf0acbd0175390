//! The demonstration of the adaptation: the board drives a spring that changes, or whose sensor gets stuck, and its model follows, or
//! not. Each code, and each change in its log, is that of the host, bit for bit.

use anyhow::{Context, Result, ensure};
use firmware::adaptation::{Alone, Change, Terms};
use firmware::isolation::{self, Isolation};
use firmware::settings::built_in;
use model::adaptation::{Parameters, Phase};
use rayon::prelude::*;
use test_bench::script::Script;
use xtask::build::{self, Board};
use xtask::variant::{Controller, Variant};

use super::lock_step::{Disturbance, TICK_S};
use super::sensor::sensing;
use super::stage::Stage;
use super::switching;
use crate::binary::{audit, size};

/// What happens, under a name, and the gain of the spring at the end.
const CASES: [(&str, Disturbance, f64); 3] = [
    ("healthy", Disturbance::None, 1.0),
    ("gain +10 % from 20 s", Disturbance::Gain(20_000, 1.1), 1.1),
    ("sensor stuck from 44 s", Disturbance::Stuck(44_000), 1.0),
];
/// Largest error of the gain at the end.
const MOST_ERROR: f64 = 0.005;

/// Builds the image, in which bank and adaptation cannot panic and use no float in the control task.
pub(super) fn stage() -> Result<Stage> {
    let stage = Stage::new(Controller::Paper, size::ADAPTATION)?;
    audit::with_adaptation(&build::read(&stage.elf)?)?;
    let size = size::measure(Variant::of(Controller::Paper), size::ADAPTATION, Board::Mps2)?;
    size.check()?;
    eprintln!("with the adaptation: {size}");
    Ok(stage)
}

/// Runs every case and prints what has changed, a line each.
pub(super) fn check(stage: &Stage) -> Result<()> {
    let run = |(name, disturbance, gain): &(&str, Disturbance, f64)| {
        one(stage, name, disturbance, *gain).with_context(|| (*name).to_owned())
    };
    let lines: Vec<String> = CASES.par_iter().map(run).collect::<Result<_>>()?;
    lines.iter().for_each(|line| println!("{line}"));
    println!("each code and each change as on the host, bit for bit");
    let status = switching::check(stage, &build::vsj()?).context("commanded by vsj link")?;
    println!("its status says: {status}");
    println!("switched off and on; settings taken over, and refused while armed and out of range");
    Ok(())
}

fn one(stage: &Stage, name: &str, disturbance: &Disturbance, gain: f64) -> Result<String> {
    let run = sensing(stage);
    let folder = stage.folder(&name.replace([' ', '%'], "-"))?;
    let script = Script::parse(&run).context("no such run")?;
    let settings = built_in(*script.settings());
    let amplifier = settings.control.amplifier;
    let bank = isolation::Terms::new(&settings, Some(settings.control.plant), amplifier.max_v);
    let mut isolation = Box::new(Isolation::off());
    isolation.start(&bank);
    let mut adaptation = Alone::new(Terms::new(&settings, amplifier, &bank));
    let (mut host, mut tick) = (Vec::new(), 0u32);
    let pass = stage.drive_with(&run, &folder, stage.spring(None, 1), disturbance, None, |control, done| {
        tick += 1;
        isolation.tick(control, done);
        host.extend(adaptation.after_tick(control, &mut isolation, done).map(|change| (tick, change)));
    })?;
    let board: Vec<(u32, Change)> = pass.said("adaptation").iter().map(|line| logged(line)).collect::<Result<_>>()?;
    ensure!(board == host, "the board says {board:?}, the host {host:?}");
    let last = board.last().map_or(Parameters::STORED, |(_, change)| change.parameters);
    ensure!((last.gain / gain - 1.0).abs() < MOST_ERROR, "a gain of {} at the end: {board:?}", last.gain);
    let said = board.iter().map(|(tick, change)| {
        let Change { phase, parameters: Parameters { time_constant, share, gain } } = change;
        let at_s = f64::from(*tick) * TICK_S;
        format!("{} at {at_s:.1} s ({time_constant:.4}, {share:.4}, {gain:.4})", phase.name())
    });
    // Of all the steps of a move, the last one.
    let phases: Vec<Phase> = board.iter().map(|(_, change)| change.phase).collect();
    let last_of = |at: &usize| phases.get(at + 1) != phases.get(*at);
    let said: Vec<String> = said.enumerate().filter(|(at, _)| last_of(at)).map(|(_, text)| text).collect();
    Ok(format!("{name}: {}", if said.is_empty() { "nothing changes".to_owned() } else { said.join(", ") }))
}

/// The change in a line of the log, without its first word.
fn logged(line: &str) -> Result<(u32, Change)> {
    let text = |key: &str| line.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
    let number = |key: &str| -> Result<f64> {
        text(key).and_then(|text| text.parse().ok()).with_context(|| format!("no {key} in `{line}`"))
    };
    let word = line.split(' ').next().unwrap_or_default();
    let phase = Phase::ALL.into_iter().find(|phase| phase.name() == word).context("no phase")?;
    let (time_constant, share, gain) = (number("time_constant")?, number("share")?, number("gain")?);
    Ok((number("tick")? as u32, Change { phase, parameters: Parameters { time_constant, share, gain } }))
}
