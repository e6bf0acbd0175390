//! `cargo xtask prove`: what holds for every accepted setting, state and input of the plain tick, shown by an SMT solver.

use std::process::Stdio;

use anyhow::{Context, Result, bail, ensure};
use xtask::{python, shell};

/// The solver and what the comparison needs.
const REQUIREMENTS: &str = "model/proof/requirements.txt";
/// Ticks of each random configuration of the comparison.
const TICKS_EACH: u64 = 1000;

/// Options of `cargo xtask prove`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Ticks in which the proved tick is compared with the one in Rust
    #[arg(long, default_value_t = 10_000_000, value_parser = clap::value_parser!(u64).range(TICKS_EACH..))]
    ticks: u64,
    /// Seed of the random settings and targets
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Each claim in a line of its own
    #[arg(long)]
    verbose: bool,
}

/// Proves the claims, then compares the tick that they are about with the one in Rust.
pub(crate) fn run(args: &Args) -> Result<()> {
    let target = shell::target_directory()?;
    let python = python::environment(&target, "prove", REQUIREMENTS)?;
    let mut theorems = shell::command(&python);
    theorems.arg("model/proof/theorems.py").args(args.verbose.then_some("-v"));
    print!("{}", shell::output(&mut theorems)?);

    shell::run(shell::cargo().args(["build", "--quiet", "--release", "-p", "vsj-model", "--example", "trace"]))?;
    let numbers = [args.seed, args.ticks / TICKS_EACH, TICKS_EACH].map(|number| number.to_string());
    let mut trace = shell::command(target.join("release/examples/trace"));
    let mut trace = trace.args(&numbers).stdout(Stdio::piped()).spawn().context("cannot start the trace")?;
    let mut compare = shell::command(&python);
    compare.args(["model/proof/differential.py", &numbers[2]]);
    compare.stdin(trace.stdout.take().context("the trace has a stdout")?);
    let agrees = compare.status().context("cannot start the comparison")?.success();
    if !agrees {
        // It writes to a closed pipe otherwise.
        let _ = trace.kill();
        let _ = trace.wait();
        bail!("the tick in model/proof/tick.py is not the one in Rust");
    }
    ensure!(trace.wait().context("the trace cannot be waited for")?.success(), "the trace failed");
    Ok(())
}
