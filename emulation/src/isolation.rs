//! `cargo xtask emulate --isolation`: instructions per tick of the isolation bank. One run of `test-bench/examples/isolation.rs` counts
//! them; the digest of every verdict is compared with the host's.

use anyhow::{Result, ensure};
use firmware::control::Untimed;
use serde_json::json;
use test_bench::isolation::run as on_this_machine;
use xtask::build::Opt;

use crate::qemu::emulator;

/// Counts and prints. A digest that differs from the host's is an error.
pub(crate) fn run(opt: Opt, as_json: bool) -> Result<()> {
    let run = emulator::count("isolation", "mps2-an386", opt)?;
    let values = run.values("isolation ")?;
    let host = on_this_machine(&mut Untimed)?;
    let target = u64::from_str_radix(&values.get::<String>("digest")?, 16)?;
    ensure!(host.digest == target, "digest {target:016x} on the target, {:016x} here", host.digest);
    let [min, mean, max]: [u32; 3] = [values.get("min")?, values.get("mean")?, values.get("max")?];
    let [state, config]: [u32; 2] = [values.get("bytes")?, values.get("config")?];
    if as_json {
        let instructions = json!({"min": min, "mean": mean, "max": max});
        println!(
            "{}",
            json!({"opt": opt.name(), "instructions_per_tick": instructions, "state": state, "config": config})
        );
    } else {
        println!("isolation bank, opt-level {}: {min} to {max} instructions per tick, mean {mean}", opt.name());
        println!("{state} bytes of state, {config} bytes of configuration; every verdict as on the host");
    }
    Ok(())
}
