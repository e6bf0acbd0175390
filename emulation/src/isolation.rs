//! `cargo xtask emulate --isolation`: instructions per tick of the isolation bank, and of the adaptation. One run each of
//! `test-bench/examples/isolation.rs` and `adaptation.rs` counts them; the digest of every verdict, or of every code and estimate, is
//! compared with the host's.

use anyhow::{Result, ensure};
use firmware::control::Untimed;
use serde_json::json;
use test_bench::isolation::run as on_this_machine;
use xtask::build::Opt;

use crate::blocks::near;
use crate::qemu::emulator;

/// Least, mean and largest number of instructions at opt-level s, of the bank and of the adaptation.
const EXPECTED: [[u32; 3]; 2] = [[24, 107, 545], [26, 27, 2330]];
/// Largest mean of the bank: as much again as the tick of the controller.
const MOST_MEAN: u32 = 108;

/// Counts and prints. A digest that differs from the host's is an error, and so is a count that is more than 5 % above or below what it
/// was, or a bank that takes more than the controller.
pub(crate) fn run(opt: Opt, as_json: bool) -> Result<()> {
    let run = emulator::count("isolation", "mps2-an386", opt)?;
    let values = run.values("isolation ")?;
    let host = on_this_machine(&mut Untimed)?;
    let target = u64::from_str_radix(&values.get::<String>("digest")?, 16)?;
    ensure!(host.digest == target, "digest {target:016x} on the target, {:016x} here", host.digest);
    let [min, mean, max]: [u32; 3] = [values.get("min")?, values.get("mean")?, values.get("max")?];
    let [state, config]: [u32; 2] = [values.get("bytes")?, values.get("config")?];
    let adaptation = adaptation(opt)?;
    if as_json {
        let instructions = json!({"min": min, "mean": mean, "max": max});
        println!(
            "{}",
            json!({"opt": opt.name(), "instructions_per_tick": instructions, "state": state, "config": config,
                "adaptation": {"min": adaptation[0], "mean": adaptation[1], "max": adaptation[2]}})
        );
    } else {
        println!("isolation bank, opt-level {}: {min} to {max} instructions per tick, mean {mean}", opt.name());
        println!("{state} bytes of state, {config} bytes of configuration; every verdict as on the host");
        let [min, mean, max] = adaptation;
        println!(
            "adaptation, after the bank's tick: {min} instructions, mean {mean}, {max} in an exchange; every code as on the host"
        );
    }
    ensure!(mean <= MOST_MEAN, "the bank takes {mean} instructions on average, the tick {MOST_MEAN}");
    let same =
        [[min, mean, max], adaptation].iter().flatten().zip(EXPECTED.iter().flatten()).all(|(is, was)| near(*is, *was));
    ensure!(opt != Opt::S || same, "least, mean and most of bank and adaptation were {EXPECTED:?} within 5 %");
    Ok(())
}

/// Counts what the control task does for the adaptation after a tick: least, mean and most instructions.
fn adaptation(opt: Opt) -> Result<[u32; 3]> {
    let run = emulator::count("adaptation", "mps2-an386,adaptation", opt)?;
    let values = run.values("adaptation ")?;
    let host = test_bench::adaptation::run(&mut Untimed)?;
    let target = u64::from_str_radix(&values.get::<String>("digest")?, 16)?;
    ensure!(host.digest == target, "digest {target:016x} on the target, {:016x} here", host.digest);
    ensure!(host.exchanges > 0, "nothing was exchanged");
    Ok([values.get("min")?, values.get("mean")?, values.get("max")?])
}
