//! `cargo xtask story`: the end-to-end demonstration. For each effect that a spring may hide:
//!
//! 1. The emulated board drives the hidden spring up and down a stair, with the paper's model of it.
//! 2. `vsj diagnose` reads the record and names the cause.
//! 3. `vsj link` sends the extended model to the board, which checks it, stores it and restarts.
//! 4. The restarted board drives the same spring up and down again.
//!
//! With `--isolation` the spring changes while the board drives it, and the board names the cause.
//! With `--adaptation` the model on the board follows what changes.
//! With `--feedback` the board keeps its wrong model and reads the spring's sensor instead.
//!
//! The result is the error of the true stiffness, which the hidden spring reports, relative to the desired one. Every
//! run is compared with the same code on the host, code by code.

mod adaptation;
mod better_model;
mod isolation;
mod lock_step;
mod sensor;
mod stage;
mod switching;
mod table;

use std::time::Instant;

use anyhow::{Context, Result};
use rayon::prelude::*;
use validation::ground_truth::Cause;

use xtask::setup;
use xtask::variant::Controller;

use better_model::Demonstration;
use stage::name;

/// The effects in `cargo xtask test`: one for each block that a model can be extended by.
const IN_TEST: [Cause; 3] = [Cause::Hysteresis, Cause::TimeConstant, Cause::ChargeLeakage];

/// Options of `cargo xtask story`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Hide this effect, or several of them in turn; three effects by default
    #[arg(long, value_name = "NAME", num_args = 1.., value_parser = named)]
    effect: Vec<Cause>,
    /// Hide each effect in turn, and none
    #[arg(long, conflicts_with = "effect")]
    all: bool,
    /// Controller of the image
    #[arg(long, value_enum, default_value = "paper")]
    controller: Controller,
    /// Let the board read the spring's sensor instead of sending it a model: without, with, and with a sensor that
    /// falls silent
    #[arg(long)]
    feedback: bool,
    /// Let the board's isolation bank name what changes: nothing, a gain, a sensor that gets stuck
    #[arg(long, conflicts_with_all = ["effect", "all", "feedback", "controller", "json"])]
    isolation: bool,
    /// Let the board's model follow what changes: nothing, a gain, a sensor that gets stuck
    #[arg(long, conflicts_with_all = ["effect", "all", "feedback", "controller", "isolation", "json", "bless", "check"])]
    adaptation: bool,
    /// Seed of the effects' sizes and of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
    /// Approve the summary of the three effects as it is now
    #[arg(long, conflicts_with_all = ["effect", "all", "controller", "feedback", "isolation"])]
    bless: bool,
    /// Compare the summary of the three effects with the approved one, and check a sensor that falls silent
    #[arg(long, conflicts_with_all = ["effect", "all", "controller", "feedback", "isolation", "seed", "json", "bless"])]
    check: bool,
}

fn named(name: &str) -> Result<Cause, String> {
    let names: Vec<_> = Cause::ALL.iter().map(|cause| cause.name()).collect();
    Cause::named(name).ok_or_else(|| format!("expected one of {}", names.join(", ")))
}

/// Runs the demonstration for each effect and prints the table.
pub(crate) fn run(args: &Args) -> Result<()> {
    setup::emulator()?;
    if args.check {
        return check();
    }
    if args.adaptation {
        return adaptation::check(&adaptation::stage()?);
    }
    if args.isolation {
        return isolation::check(&isolation::stage()?);
    }
    let effects: Vec<Option<Cause>> = match (args.all, args.effect.as_slice()) {
        (true, _) => [None].into_iter().chain(Cause::ALL.map(Some)).collect(),
        (false, []) => IN_TEST.map(Some).to_vec(),
        (false, given) => given.iter().copied().map(Some).collect(),
    };
    if args.feedback {
        let stage = sensor::stage(args.controller)?;
        let outcomes = each(&effects, |effect| sensor::run(&stage, effect, args.seed), sensor::line)?;
        if args.json {
            println!("{}", serde_json::to_string(&outcomes)?);
        } else {
            print!("{}", sensor::table(&outcomes));
        }
        return Ok(());
    }
    let demonstration = Demonstration::new(args.controller)?;
    let outcomes = each(&effects, |effect| demonstration.run(effect, args.seed), |outcome| table::line(outcome, 2))?;
    if args.bless {
        table::bless(&outcomes)?;
    }
    if args.json {
        println!("{}", serde_json::to_string(&outcomes)?);
    } else {
        print!("{}", table::table(&outcomes, 2));
    }
    Ok(())
}

/// Runs `work` for each effect in parallel, each with a board and a spring of its own. Prints each `line` as soon as it
/// is known.
fn each<T: Send>(
    effects: &[Option<Cause>],
    work: impl Fn(Option<Cause>) -> Result<T> + Sync,
    line: impl Fn(&T) -> String + Sync,
) -> Result<Vec<T>> {
    let one = |effect: &Option<Cause>| {
        let one = work(*effect).with_context(|| name(*effect))?;
        eprintln!("{}", line(&one));
        Ok(one)
    };
    effects.par_iter().map(one).collect()
}

/// The step of `cargo xtask test`: three effects, whose summary must be the approved one, a sensor that falls silent, the
/// isolation bank, and the adaptation.
fn check() -> Result<()> {
    let begin = Instant::now();
    let demonstration = Demonstration::new(Controller::Paper)?;
    let outcomes = each(&IN_TEST.map(Some), |effect| demonstration.run(effect, 1), |outcome| table::line(outcome, 2))?;
    table::compare(&outcomes)?;
    eprintln!("end-to-end demonstration of three effects in {:.0} s, as approved", begin.elapsed().as_secs_f64());
    let begin = Instant::now();
    let stage = isolation::stage()?;
    sensor::check(&stage).context("with a sensor that falls silent")?;
    eprintln!("a sensor in the loop that falls silent, in {:.0} s", begin.elapsed().as_secs_f64());
    let begin = Instant::now();
    isolation::check(&stage)?;
    eprintln!("the isolation bank in the loop, in {:.0} s", begin.elapsed().as_secs_f64());
    let begin = Instant::now();
    adaptation::check(&adaptation::stage()?)?;
    eprintln!("the adaptation in the loop, in {:.0} s", begin.elapsed().as_secs_f64());
    Ok(())
}
