//! Runs the image that is flashed to the STM32G474 on models of the chip's registers, which are in `emulation/models/`.
//!
//! In: a variant of the image. Out: one line for each run, or an error that names what left the chip wrongly. The
//! checks ([`checks`]) read the DAC's register, the enable's pin and the log's bytes ([`events`]), with a host at the line
//! ([`host`]), which sends what [`schedule`] says, and with faults ([`runs`]).

mod checks;
mod events;
mod host;
mod runs;
mod schedule;

use std::fs;

use anyhow::{Context, Result, bail, ensure};
use link::Block;
use model::Settings;
use serde::Deserialize;
use serde_json::json;
use xtask::build::{self, Board, Opt};
use xtask::tally::Tally;
use xtask::variant::Variant;
use xtask::{python, segments, shell};

use crate::binary::{audit, elf, size};
use crate::variant;
use checks::Check;
use events::Events;
use schedule::{RANDOM, Replacement, page};

/// Limits of this verification, printed after every run.
const CANNOT_SHOW: &str = "\
not shown: real time (an instruction is one cycle here; no wait states, no conversion times), analogue behaviour (DAC, monitors,
  the amplifier's pull-down), silicon errata, a chip that differs from its manual";

/// Arguments of `cargo xtask boot`.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    variant: Variant,
    /// Every image: each controller with each amplifier, and a reset in each operation of the flash with which a block is stored
    #[arg(long, conflicts_with_all = ["controller", "limit_v", "brief"])]
    all: bool,
    /// Only the runs in which controller or amplifier matter
    #[arg(long)]
    brief: bool,
    /// Only the run of this name
    #[arg(long, value_name = "RUN", conflicts_with_all = ["all", "brief"])]
    only: Vec<String>,
}

/// Runs the image of a variant, or those of all.
pub(crate) fn run(args: &Args) -> Result<()> {
    if args.all {
        let every = |operations: usize| (0..operations).collect();
        return Variant::ALL.into_iter().try_for_each(|variant| one(variant, every, |_| true).map(drop));
    }
    let [settings, model] = Replacement::both(args.variant)?;
    let known = checks::of(&[], args.variant, (&settings, &[]), (&model, &[]));
    if let Some(unknown) = args.only.iter().find(|name| !known.iter().any(|it| it.run == *name)) {
        bail!("there is no run `{unknown}`");
    }
    let is_wanted = |check: &Check<'_>| {
        (check.is_of_variant || !args.brief) && (args.only.is_empty() || args.only.iter().any(|name| name == check.run))
    };
    let some = |operations: usize| vec![0, operations / 2, operations - 2, operations - 1];
    let faults = one(args.variant, some, is_wanted)?;
    if args.brief || !args.only.is_empty() {
        return Ok(());
    }
    let faults = ("faults injected in the image that is flashed, on register models".to_owned(), faults as u64);
    Tally::now([faults])?.write(&args.variant.tally("boot"))
}

/// Builds the image, runs it once for each case, and prints what each run showed. `cuts` chooses, of a number of operations of the flash,
/// those in which the chip is reset; only the runs that are wanted take place. Returns the number of injected faults.
fn one(variant: Variant, cuts: impl Fn(usize) -> Vec<usize>, is_wanted: impl Fn(&Check<'_>) -> bool) -> Result<usize> {
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
    let replaced = Replacement::both(variant)?;
    let [settings_cuts, model_cuts] = replaced.each_ref().map(|it| cuts(it.operations()));
    let [settings, model] = &replaced;
    let mut checks = checks::of(&bytes, variant, (settings, &settings_cuts), (model, &model_cuts));
    let all = checks.len();
    checks.retain(is_wanted);
    if checks.len() < all {
        println!("{} of {all} runs", checks.len());
    }
    let names: Vec<&str> = checks.iter().map(|check| check.run).collect();
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
        "later_us": schedule::later_us(variant),
        "settings": schedule::hex(&page(Block::Settings, &settings.old)?),
        "model": schedule::hex(&page(Block::Model, &model.old)?),
        "cuts": { "settings": settings_cuts, "model": model_cuts },
        "runs": names,
        "hosts": {
            "host": schedule::armed().frames(RANDOM),
            // Of another chip.
            "recorded": schedule::armed().frames(!RANDOM),
            "level": schedule::level().frames(RANDOM),
            "flood": schedule::flood().frames(RANDOM),
            "sent": schedule::sent(variant)?.frames(RANDOM),
            "cut settings": settings.cut(settings_cuts.len()).frames(RANDOM),
            "cut model": model.cut(model_cuts.len()).frames(RANDOM),
            "protected": schedule::protected()?.frames(RANDOM),
        },
    });
    fs::write(&case, case_of.to_string()).with_context(|| format!("cannot write {}", case.display()))?;
    let output = shell::json(shell::command(python).args(["-B", "emulation/models/boot.py"]).arg(&bin).arg(&case))?;

    for check in &checks {
        let events = Events::deserialize(&output[check.run]).with_context(|| format!("no run `{}`", check.run))?;
        println!("{}: {}", check.run, (check.shows)(&events).context(check.run)?);
    }
    // Last: a run that does not end as it must may use any part of the stack.
    if let Some(depth) = runs::stack(&output, size.worst_stack())? {
        println!("stack: {depth}");
    }
    println!("{CANNOT_SHOW}");
    Ok(checks.iter().map(|check| check.faults).sum())
}
