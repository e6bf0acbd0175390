//! Runs the image that is flashed to the STM32G474 on models of the chip's registers, which are in `emulation/models/`.
//!
//! In: a variant of the image. Out: one line for each run, or an error that names what left the chip wrongly. The
//! checks read the DAC's register, the enable's pin and the log's bytes ([`events`]), with a host at the line
//! ([`host`]) and with faults ([`runs`]).

mod events;
mod host;
mod runs;

use std::fs;

use anyhow::{Context, Result, ensure};
use model::Settings;
use model::supervisor::Mismatch;
use serde::Deserialize;
use xtask::build::{self, Board, Opt};
use xtask::tally::Tally;
use xtask::variant::Variant;
use xtask::{python, segments, shell};

use crate::binary::{audit, elf, size};
use crate::variant;
use events::Events;
use runs::{JITTER_US, KILL_US, MONITOR_US, PERIOD_US};

/// Limits of this verification, printed after every run.
const CANNOT_SHOW: &str = "\
not shown: real time (an instruction is one cycle here; no wait states, no conversion times), analogue behaviour (DAC, monitors,
  the amplifier's pull-down), silicon errata, a chip that differs from its manual";

/// Arguments of `cargo xtask boot`.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    variant: Variant,
    /// Every image: each controller with each amplifier
    #[arg(long, conflicts_with_all = ["controller", "limit_v"])]
    all: bool,
}

/// Runs the image of a variant, or those of all.
pub(crate) fn run(args: &Args) -> Result<()> {
    if args.all { Variant::ALL.into_iter().try_for_each(one) } else { one(args.variant) }
}

/// Builds the image, runs it once for each case, and prints what each run showed.
fn one(variant: Variant) -> Result<()> {
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
    let output = shell::json(
        shell::command(python)
            .args(["-B", "emulation/models/boot.py"])
            .arg(&bin)
            .args(
                [ticks[0].address, panic.address, rtt, main.address, taken, stack]
                    .map(|address| format!("{address:#x}")),
            )
            .arg(amplifier.full_scale_v.to_string())
            .arg(host::frames(host::RANDOM).to_string())
            .arg(host::frames(!host::RANDOM).to_string())
            .arg(format!("{:#x}", host::RANDOM))
            .arg(host::hex(&host::stored_settings(variant)?)),
    )?;
    let events = |name: &str| Events::deserialize(&output[name]).with_context(|| format!("no run `{name}`"));

    println!("{}", runs::quiet(&events("quiet")?, &bytes, variant).context("without a fault")?);
    println!("host: {}", host::check(&events("host")?, variant).context("with a host")?);
    println!("tick: {}", runs::instructions(&events("host")?, variant).context("instructions of a tick")?);
    println!("stack: {}", runs::stack(&output, size.worst_stack())?);
    let hang_us = f64::from(firmware::LONGEST_HANG_MS) * 1e3;
    for (name, within_us, log) in [
        ("panic", KILL_US, "panic at injected.rs:7"),
        ("hard fault", KILL_US, "name=hard-fault"),
        ("two wrong bits", KILL_US, "name=hard-fault"),
        ("stack overflow", KILL_US, "name=hard-fault"),
        ("hang", hang_us + KILL_US, "name=watchdog"),
    ] {
        println!("{name}: {}", runs::stopped(&events(name)?, &bytes, within_us, log).context(name)?);
    }
    for (name, within_us, mismatch) in [
        ("interlock", PERIOD_US + JITTER_US, None),
        ("no voltage", MONITOR_US + JITTER_US, Some(Mismatch::Open)),
        ("current", MONITOR_US + JITTER_US, Some(Mismatch::Leakage)),
        ("other amplifier", MONITOR_US + JITTER_US, Some(Mismatch::Reference)),
        ("supply of 3.6 V", MONITOR_US + JITTER_US, Some(Mismatch::Reference)),
    ] {
        // An amplifier below the image's limit has no such run: it is no danger.
        if output[name].is_null() {
            continue;
        }
        println!("{name}: {}", runs::faulted(&events(name)?, &bytes, within_us, mismatch).context(name)?);
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
    println!("hang with interrupts off: {}", runs::deaf(&events("deaf")?, &bytes).context("deaf")?);
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
    // All runs but the one without a mishap and the one with a host.
    let runs = output.as_object().context("no runs")?.values().filter(|run| !run.is_null()).count() as u64;
    let faults = ("faults injected in the image that is flashed, on register models".to_owned(), runs - 2);
    Tally::now([faults])?.write(&variant.tally("boot"))
}
