//! Instructions a tick, beside what one could run instead: counted in one run by `firmware/examples/rivals.rs`.

use anyhow::{Result, ensure};
use serde_json::{Value, json};
use xtask::build::Opt;

use crate::qemu::emulator::{self, Run};

/// The first is this controller; names as in the example.
const CONTENDERS: [(&str, &str); 5] = [
    ("tick", "this controller, the whole tick"),
    ("tick_f64", "the whole tick in f64"),
    ("idsp", "idsp, clamped i32 biquad: PI only"),
    ("pid", "pid, f32: PI only"),
    ("discrete_pid", "discrete_pid, f32: PI only"),
];
/// Where all must arrive, and how close, in mV: single precision is no better.
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

/// `cargo xtask emulate --rivals`.
pub(crate) fn run(opt: Opt, as_json: bool) -> Result<()> {
    let rows = count(opt)?;
    if as_json {
        println!("{}", report(opt, &rows));
    } else {
        print!("{}", table(opt, &rows));
    }
    Ok(())
}

/// Every contender, this controller first.
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

/// By the mean.
fn to_ours(row: &Row, rows: &[Row]) -> f64 {
    f64::from(row.mean) / f64::from(rows[0].mean)
}

pub(crate) fn table(opt: Opt, rows: &[Row]) -> String {
    let head = format!("instructions a tick, opt-level {}", opt.name());
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
