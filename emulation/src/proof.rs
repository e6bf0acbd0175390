//! `cargo xtask proof`: all that the emulated firmware must show, as a step of `cargo xtask test`.

use std::ops::RangeInclusive;

use anyhow::{Context, Result, ensure};
use host_sim::log::{Event, Item, Summary};
use test_bench::script::Script;
use xtask::build::{self, Board, Opt};
use xtask::variant::{Controller, Variant};

use crate::binary::{audit, size};
use crate::qemu::comparison::Comparison;
use crate::qemu::emulator::{self, Run};
use crate::{drill, rivals, talk};

/// Number of instructions that one tick of the model may need. Fewer would mean that something is left out.
const INSTRUCTIONS: RangeInclusive<u32> = 98..=110;
/// Scripts whose codes and estimates must be the host's, bit for bit.
const RUNS: [&str; 3] = ["stair", "random 1", "late 20261121"];

/// Runs every check at both opt-levels and prints a line for each to stderr.
pub(crate) fn run() -> Result<()> {
    for opt in Opt::ALL {
        let elf = build::image(Board::Mps2, opt)?;
        let name = opt.name();
        let functions = audit::run(&build::read(&elf)?)?;
        eprintln!(
            "opt-level {name}: no way into a panic from the control tick ({functions} functions), no float in it, no heap"
        );
        for script in RUNS {
            bit_for_bit(&elf, script).with_context(|| format!("opt-level {name}, {script}"))?;
        }
        if opt == Opt::S {
            eprint!("{}", rivals::table(opt, &rivals::count(opt)?));
            drill::all(&elf, false)?;
            eprintln!("link: {}", talk::run(&elf).context("the host's link")?);
        }
    }
    size::measure(Variant::of(Controller::Paper), &[], Board::Mps2)?.check()
}

fn bit_for_bit(elf: &std::path::Path, script: &str) -> Result<()> {
    let run = emulator::play(elf, script, emulator::SHIFT, |_| {})?;
    counted(script, &run)?;
    let comparison = Comparison::new(script, &run)?;
    comparison.check()?;
    let [min, mean, max] = comparison.instructions;
    let within = INSTRUCTIONS.contains(&min) && INSTRUCTIONS.contains(&max);
    ensure!(within, "{min} to {max} instructions in a tick, expected {INSTRUCTIONS:?}");
    eprintln!(
        "{script}: {} ticks in {:.1} s, none missed, {:016x} as on the host, {min} to {max} instructions per tick, mean {mean}",
        comparison.ticks,
        run.took.as_secs_f64(),
        comparison.target_digest,
    );
    Ok(())
}

/// An error unless the totals over the log have every tick since the board's start. The log has their low 32 bits, which wrap in
/// the run `late`.
fn counted(script: &str, run: &Run) -> Result<()> {
    let script = Script::parse(script).context("no such script")?;
    let mut summary = Summary::default();
    let ticking = run.log.iter().filter(|line| !matches!(line.event, Event::Done(_)));
    ticking.for_each(|line| summary.add(&Item::Line(line.clone())));
    // The last line of the statistics is one second before the end at most.
    let end = script.first_tick() + u64::from(script.ticks());
    ensure!(
        (end - 1000..=end).contains(&summary.ticks) && summary.boots_not_seen == 0,
        "the log has {} ticks and {} restarts, {end} ticks expected",
        summary.ticks,
        summary.boots_not_seen
    );
    Ok(())
}
