//! The whole story in one run, for each effect that a spring may hide:
//!
//! 1. The emulated board leads the hidden spring up and down a stair, with the paper's model of it.
//! 2. `vsj diagnose` reads the record and names the cause.
//! 3. `vsj link` sends the extended model to the board, which checks it, stores it and restarts.
//! 4. The board, started anew, leads the same spring up and down again.
//!
//! Or another one: the board keeps its wrong model, and hears the spring's sensor instead.
//!
//! What counts is the true stiffness beside the desired one, from the hidden spring itself. Every run is held against
//! the same code on this machine, code by code.

mod better_model;
mod lock_step;
mod sensor;
mod stage;
mod table;

use std::time::Instant;

use anyhow::{Context, Result};
use rayon::prelude::*;
use validation::ground_truth::Cause;

use crate::setup;
use crate::variant::Controller;
use better_model::Teller;
use stage::name;

/// Told in every test: one of each block that a model can be extended by.
const IN_TEST: [Cause; 3] = [Cause::Hysteresis, Cause::TimeConstant, Cause::ChargeLeakage];

/// Options of `cargo xtask story`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Hide this effect, or several; three of them without
    #[arg(long, value_name = "NAME", num_args = 1.., value_parser = named)]
    effect: Vec<Cause>,
    /// Hide each effect in turn, and none
    #[arg(long, conflicts_with = "effect")]
    all: bool,
    /// Who leads the spring
    #[arg(long, value_enum, default_value = "paper")]
    controller: Controller,
    /// Let the board hear the spring's sensor instead of sending it a model: without, with, and with one that falls silent
    #[arg(long)]
    feedback: bool,
    /// Where the effects' sizes and the noise come from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
    /// Approve the summary of the three effects as it is now
    #[arg(long, conflicts_with_all = ["effect", "all", "controller", "feedback"])]
    bless: bool,
}

fn named(name: &str) -> Result<Cause, String> {
    let names: Vec<_> = Cause::ALL.iter().map(|cause| cause.name()).collect();
    Cause::named(name).ok_or_else(|| format!("expected one of {}", names.join(", ")))
}

/// `cargo xtask story`.
pub(crate) fn run(args: &Args) -> Result<()> {
    setup::emulator()?;
    let effects: Vec<Option<Cause>> = match (args.all, args.effect.as_slice()) {
        (true, _) => [None].into_iter().chain(Cause::ALL.map(Some)).collect(),
        (false, []) => IN_TEST.map(Some).to_vec(),
        (false, given) => given.iter().copied().map(Some).collect(),
    };
    if args.feedback {
        let stage = sensor::stage(args.controller)?;
        let heard = each(&effects, |effect| sensor::hear(&stage, effect, args.seed), sensor::line)?;
        if args.json {
            println!("{}", serde_json::to_string(&heard)?);
        } else {
            print!("{}", sensor::table(&heard));
        }
        return Ok(());
    }
    let teller = Teller::new(args.controller)?;
    let told = each(&effects, |effect| teller.tell(effect, args.seed), |told| table::line(told, 2))?;
    if args.bless {
        table::bless(&told)?;
    }
    if args.json {
        println!("{}", serde_json::to_string(&told)?);
    } else {
        print!("{}", table::table(&told, 2));
    }
    Ok(())
}

/// One board and one spring for each effect, all at once; each is shown as soon as it is there.
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

/// As a step of `cargo xtask test`: three effects, the summary as approved; a sensor that falls silent.
pub(crate) fn check() -> Result<()> {
    let begin = Instant::now();
    let teller = Teller::new(Controller::Paper)?;
    let told = each(&IN_TEST.map(Some), |effect| teller.tell(effect, 1), |told| table::line(told, 2))?;
    table::compare(&told)?;
    eprintln!("the story of three effects in {:.0} s, as approved", begin.elapsed().as_secs_f64());
    let begin = Instant::now();
    sensor::check().context("with a sensor that falls silent")?;
    eprintln!("a sensor in the loop that falls silent, in {:.0} s", begin.elapsed().as_secs_f64());
    Ok(())
}
