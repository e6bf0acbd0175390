//! `cargo xtask emulate --blocks`: instructions per tick for each kind of spring under each controller. One run of
//! `test-bench/examples/blocks.rs` counts them; the digest of each combination is compared with the host's.

use anyhow::{Result, ensure};
use firmware::control::Untimed;
use serde_json::{Value, json};
use test_bench::blocks::{CONTROLLERS, SPRINGS, run as on_this_machine};

use xtask::build::Opt;

use crate::qemu::emulator;

/// Mean and largest number of instructions per tick: one row for each spring, one column for each controller.
type Table = Vec<[(u32, u32); CONTROLLERS.len()]>;

/// Counts and prints the table. A digest that differs from the host's is an error.
pub(crate) fn run(opt: Opt, as_json: bool) -> Result<()> {
    let counted = count(opt)?;
    if as_json {
        println!("{}", report(opt, &counted));
    } else {
        print!("{}", table(opt, &counted));
    }
    Ok(())
}

fn count(opt: Opt) -> Result<Table> {
    let run = emulator::count("blocks", "mps2-an386,robust", opt)?;
    let mut counted = vec![[(0, 0); CONTROLLERS.len()]; SPRINGS.len()];
    for (row, (name, plant)) in SPRINGS.iter().enumerate() {
        for (column, (controller, compensation)) in CONTROLLERS.iter().enumerate() {
            let values = run.values(&format!("block spring={row} controller={column} "))?;
            let host = on_this_machine(plant.as_ref(), *compensation, &mut Untimed)?;
            let target = u64::from_str_radix(&values.get::<String>("digest")?, 16)?;
            ensure!(host == target, "{name}, {controller}: digest {target:016x} on the target, {host:016x} here");
            counted[row][column] = (values.get("mean")?, values.get("max")?);
        }
    }
    Ok(counted)
}

fn table(opt: Opt, counted: &Table) -> String {
    let head = format!("instructions/tick, opt-level {}: mean, max", opt.name());
    let mut text = format!("{head:<44}");
    for (name, _) in CONTROLLERS {
        text += &format!("{name:>14}");
    }
    text.push('\n');
    for ((name, _), row) in SPRINGS.iter().zip(counted) {
        text += &format!("{name:<44}");
        for (mean, most) in row {
            text += &format!("{mean:>8}{most:>6}");
        }
        text.push('\n');
    }
    text + "every code and estimate as on the host\n"
}

fn report(opt: Opt, counted: &Table) -> Value {
    let rows = SPRINGS.iter().zip(counted).flat_map(|((spring, _), row)| {
        CONTROLLERS.iter().zip(row).map(move |((controller, _), (mean, max))| {
            json!({"spring": spring, "controller": controller, "mean": mean, "max": max})
        })
    });
    json!({"opt": opt.name(), "rows": rows.collect::<Vec<_>>()})
}
