//! Runs the image that is flashed to the STM32G474 on models of the chip's registers, which are in `emulation/models/`.
//!
//! In: a variant of the image. Out: one line for each run, or an error that names what left the chip wrongly. The
//! checks read the DAC's register, the enable's pin and the log's bytes ([`events`]), with a host at the line
//! ([`host`]), which sends what [`schedule`] says, and with faults ([`runs`]).

mod events;
mod host;
mod runs;
mod schedule;

use std::fs;

use anyhow::{Context, Result, ensure};
use firmware::settings::SUPERVISION;
use link::Block;
use model::Settings;
use model::supervisor::{Fault, Mismatch};
use serde::Deserialize;
use serde_json::json;
use xtask::build::{self, Board, Opt};
use xtask::tally::Tally;
use xtask::variant::Variant;
use xtask::{python, segments, shell};

use crate::binary::{audit, elf, size};
use crate::variant;
use events::Events;
use runs::{JITTER_US, KILL_US, MONITOR_US, PERIOD_US};
use schedule::{RANDOM, page};

/// Limits of this verification, printed after every run.
const CANNOT_SHOW: &str = "\
not shown: real time (an instruction is one cycle here; no wait states, no conversion times), analogue behaviour (DAC, monitors,
  the amplifier's pull-down), silicon errata, a chip that differs from its manual";

/// Arguments of `cargo xtask boot`.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    variant: Variant,
    /// Every image: each controller with each amplifier, and a reset in each operation of the flash with which a model is stored
    #[arg(long, conflicts_with_all = ["controller", "limit_v"])]
    all: bool,
}

/// Runs the image of a variant, or those of all.
pub(crate) fn run(args: &Args) -> Result<()> {
    let last = schedule::operations()? - 1;
    if args.all {
        let every: Vec<usize> = (0..=last).collect();
        Variant::ALL.into_iter().try_for_each(|variant| one(variant, &every))
    } else {
        one(args.variant, &[0, last / 2, last - 1, last])
    }
}

/// Builds the image, runs it once for each case, and prints what each run showed. `cuts` numbers the operations of the flash in which the
/// chip is reset.
fn one(variant: Variant, cuts: &[usize]) -> Result<()> {
    let Settings { amplifier, .. } = variant::settings(variant);
    println!(
        "image of the {} controller, {} to {} V",
        variant::controller(variant).name(),
        amplifier.min_v,
        amplifier.max_v
    );
    let elf = build::image_with(&variant.features(), Board::Nucleo, Opt::S)?;
    let bytes = build::read(&elf)?;
    let flash = segments::flash(&bytes)?;
    ensure!(flash.address == 0x0800_0000, "the image begins at {:#x}", flash.address);
    let size = size::measure(variant, &[], Board::Nucleo)?;
    size.check()?;
    println!(
        "size: {size}; no way into a panic from the control tick ({} functions), no float in it, no heap",
        audit::run(&bytes)?
    );
    let bin = elf.with_extension("boot.bin");
    fs::write(&bin, &flash.bytes).with_context(|| format!("cannot write {}", bin.display()))?;

    let functions = elf::functions(&bytes)?;
    let ticks = audit::ticks(&functions)?;
    ensure!(ticks.len() == 1, "{} control ticks in the image", ticks.len());
    let panic = functions.iter().find(|f| f.name == "core::panicking::panic").context("no `panic` in the image")?;
    let main = functions.iter().find(|f| f.name == "main").context("no `main` in the image")?;
    let rtt = elf::symbol(&bytes, "_SEGGER_RTT")?;
    let taken = elf::symbol(&bytes, "cortex_m::peripheral::TAKEN")?;
    let stack = elf::symbol(&bytes, "_stack_start")?;
    let python = python::environment(&shell::target_directory()?, "boot", "emulation/models/requirements.txt")?;
    let case = elf.with_extension("boot.json");
    let case_of = json!({
        "tick": ticks[0].address,
        "panic": panic.address,
        "rtt": rtt,
        "main": main.address,
        "taken": taken,
        "stack": stack,
        "volts": amplifier.full_scale_v,
        "random": RANDOM,
        "settings": schedule::hex(&page(Block::Settings, &schedule::settings(variant)?)?),
        "model": schedule::hex(&page(Block::Model, &schedule::old_model()?)?),
        "cuts": cuts,
        "hosts": {
            "host": schedule::armed().frames(RANDOM),
            // Of another chip.
            "recorded": schedule::armed().frames(!RANDOM),
            "level": schedule::level().frames(RANDOM),
            "flood": schedule::flood().frames(RANDOM),
            "sent": schedule::sent(variant)?.frames(RANDOM),
            "cut": schedule::cut(cuts.len())?.frames(RANDOM),
            "protected": schedule::protected()?.frames(RANDOM),
        },
    });
    fs::write(&case, case_of.to_string()).with_context(|| format!("cannot write {}", case.display()))?;
    let output = shell::json(shell::command(python).args(["-B", "emulation/models/boot.py"]).arg(&bin).arg(&case))?;
    let events = |name: &str| Events::deserialize(&output[name]).with_context(|| format!("no run `{name}`"));

    println!("{}", runs::quiet(&events("quiet")?, &bytes, variant).context("without a fault")?);
    println!("host: {}", host::check(&events("host")?, variant).context("with a host")?);
    println!("tick: {}", runs::instructions(&events("host")?, variant).context("instructions of a tick")?);
    println!("stack: {}", runs::stack(&output, size.worst_stack())?);
    let tolerated = SUPERVISION.missed_ticks_allowed;
    let hang_us = f64::from(firmware::LONGEST_HANG_MS) * 1e3;
    for (name, within_us, log) in [
        ("panic", KILL_US, "panic at injected.rs:7"),
        ("hard fault", KILL_US, "name=hard-fault"),
        ("two wrong bits", KILL_US, "name=hard-fault"),
        ("stack overflow", KILL_US, "name=hard-fault"),
        ("hang", hang_us + KILL_US, "name=watchdog"),
        ("stopped timer", hang_us + KILL_US, "name=watchdog"),
    ] {
        println!("{name}: {}", runs::stopped(&events(name)?, &bytes, within_us, log).context(name)?);
    }
    println!("flood: {}", host::flood(&events("flood")?, variant).context("flood")?);
    println!("late tick: {}", host::late(&events("late tick")?, tolerated).context("late tick")?);
    for (name, within_us, fault, mismatch) in [
        ("interlock", PERIOD_US + JITTER_US, Fault::Interlock, None),
        ("flood", PERIOD_US + JITTER_US, Fault::Interlock, None),
        // The tick that takes 7.4 ms still ends; the next one on the grid detects it.
        ("overrun", 8.0 * PERIOD_US + JITTER_US, Fault::Overrun, None),
        ("no voltage", MONITOR_US + JITTER_US, Fault::Monitor, Some(Mismatch::Open)),
        ("current", MONITOR_US + JITTER_US, Fault::Monitor, Some(Mismatch::Leakage)),
        ("other amplifier", MONITOR_US + JITTER_US, Fault::Monitor, Some(Mismatch::Reference)),
        ("supply of 3.6 V", MONITOR_US + JITTER_US, Fault::Monitor, Some(Mismatch::Reference)),
    ] {
        // An amplifier below the image's limit has no such run: it is no danger.
        if output[name].is_null() {
            continue;
        }
        // In the flood the buffer of the line is full, and a frame waits for room in it.
        let frames = if name == "flood" { 2 } else { 1 };
        println!(
            "{name}: {}",
            runs::faulted(&events(name)?, &bytes, within_us, fault, mismatch, frames).context(name)?
        );
    }
    println!("torn store: {}", runs::torn(&events("torn")?, &bytes).context("torn")?);
    println!("stored settings: {}", runs::stored(&events("stored settings")?, &bytes).context("stored settings")?);
    println!("damaged settings: {}", runs::damaged(&events("damaged settings")?, &bytes).context("damaged settings")?);
    for (name, cause) in [
        ("dip", "reset=brown-out last_fault=8"),
        ("button", "reset=pin last_fault=4"),
        ("button while armed", "reset=pin last_fault=8"),
    ] {
        println!("{name}: {}", runs::cut(&events(name)?, &bytes, cause).context(name)?);
    }
    for name in ["deaf", "halted"] {
        println!("{name}: {}", runs::deaf(&events(name)?, &bytes).context(name)?);
    }
    println!("stalled tasks: {}", runs::stalled(&events("stalled tasks")?, &bytes).context("stalled tasks")?);
    println!("sent: {}", host::sent(&events("sent")?, variant).context("sent")?);
    println!("cut: {}", host::cut(&events("cut")?, cuts).context("cut")?);
    println!("protected page: {}", host::protected(&events("protected page")?).context("protected page")?);
    println!("replayed: {}", runs::replayed(&events("replayed")?, &bytes).context("replayed")?);
    println!("no random number: {}", runs::unrandom(&events("no random number")?, &bytes).context("no random number")?);
    for (name, field) in [("unguarded", "guards"), ("wrong image", "image")] {
        println!("{name}: {}", runs::refused(&events(name)?, &bytes, field).context(name)?);
    }
    for name in ["stuck bit", "coupled bits"] {
        println!("{name}: {}", runs::unfit(&events(name)?, &bytes).context(name)?);
    }
    for (name, seen_hz) in [("slow processor", 64_000), ("no low-speed clock", 0)] {
        println!("{name}: {}", runs::wrong_clock(&events(name)?, &bytes, seen_hz).context(name)?);
    }
    println!("brown-out level: {}", runs::delivered(&events("brown-out level")?, &bytes).context("brown-out level")?);
    println!(
        "voltage at the start: {}",
        runs::held(&events("voltage at the start")?, &bytes).context("voltage at the start")?
    );
    println!("{CANNOT_SHOW}");
    // All runs but those without a mishap; the flash is cut in one run several times.
    let runs = output.as_object().context("no runs")?.values().filter(|run| !run.is_null()).count();
    let faults = (runs - ["quiet", "host", "sent", "cut"].len() + cuts.len()) as u64;
    let faults = ("faults injected in the image that is flashed, on register models".to_owned(), faults);
    Tally::now([faults])?.write(&variant.tally("boot"))
}
