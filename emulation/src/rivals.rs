//! `cargo xtask emulate --rivals`: instructions per tick, compared with other controllers. One run of
//! `test-bench/examples/rivals.rs` counts them.

use anyhow::{Result, ensure};
use serde_json::{Value, json};
use xtask::build::Opt;

use crate::qemu::emulator::{self, Run};

/// Name in the example and description of each controller. The first is this project's.
const CONTENDERS: [(&str, &str); 5] = [
    ("tick", "this controller, the whole tick"),
    ("tick_f64", "the whole tick in f64"),
    ("idsp", "idsp, clamped i32 biquad: PI only"),
    ("pid", "pid, f32: PI only"),
    ("discrete_pid", "discrete_pid, f32: PI only"),
];
/// Voltage that every controller must reach, in mV, and its tolerance, which single precision needs.
const END_MV: i32 = 300_000;
const TOLERANCE_MV: i32 = 100;

/// One line of the table.
pub(crate) struct Row {
    name: &'static str,
    what: &'static str,
    min: u32,
    mean: u32,
    max: u32,
}

/// Counts and prints the table.
pub(crate) fn run(opt: Opt, as_json: bool) -> Result<()> {
    let rows = count(opt)?;
    if as_json {
        println!("{}", report(opt, &rows));
    } else {
        print!("{}", table(opt, &rows));
    }
    Ok(())
}

/// Counts the instructions of every controller. A controller that does not reach the voltage is an error.
pub(crate) fn count(opt: Opt) -> Result<Vec<Row>> {
    let run = emulator::count("rivals", "mps2-an386", opt)?;
    CONTENDERS.iter().map(|(name, what)| row(name, what, &run)).collect()
}

fn row(name: &'static str, what: &'static str, run: &Run) -> Result<Row> {
    let values = run.values(&format!("rival name={name} "))?;
    let end_mv: i32 = values.get("end_mv")?;
    ensure!((end_mv - END_MV).abs() <= TOLERANCE_MV, "{name} ends at {end_mv} mV instead of {END_MV} mV");
    Ok(Row { name, what, min: values.get("min")?, mean: values.get("mean")?, max: values.get("max")? })
}

/// Ratio of the mean number of instructions to that of the first row.
fn to_ours(row: &Row, rows: &[Row]) -> f64 {
    f64::from(row.mean) / f64::from(rows[0].mean)
}

pub(crate) fn table(opt: Opt, rows: &[Row]) -> String {
    let head = format!("instructions per tick, opt-level {}", opt.name());
    let mut text = format!("{head:<36}{:>7}{:>7}{:>7}{:>10}\n", "min", "mean", "max", "to ours");
    for row @ Row { what, min, mean, max, .. } in rows {
        text += &format!("{what:<36}{min:>7}{mean:>7}{max:>7}{:>10.2}\n", to_ours(row, rows));
    }
    text
}

fn report(opt: Opt, rows: &[Row]) -> Value {
    let row = |row: &Row| {
        json!({"name": row.name, "what": row.what, "min": row.min, "mean": row.mean, "max": row.max,
               "to_ours": to_ours(row, rows)})
    };
    json!({"opt": opt.name(), "rows": rows.iter().map(row).collect::<Vec<_>>()})
}
