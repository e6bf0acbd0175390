//! Time of `python -m vsj.fleet` with one worker and with two.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;
use xtask::{python, shell};

use crate::package;

/// Smallest ratio of the times.
const SPEED_UP: f64 = 1.8;

/// Installs the Python package and measures both, over a number of records.
///
/// # Errors
/// If the build or the script fails.
pub(crate) fn measure(target: &Path, records: u32) -> Result<Value> {
    let python = python::environment(target, "python", package::REQUIREMENTS)?;
    package::install(&python, target, package::RELEASE)?;
    shell::json(shell::command(&python).arg("xtask/bench/fleet.py").arg(records.to_string()))
}

/// The table of what [`measure`] returns; a ratio below its bound is marked and is no error.
///
/// # Errors
/// If a number is missing.
pub(crate) fn table(fleet: &Value) -> Result<String> {
    let number = |field: &str| fleet[field].as_f64().with_context(|| format!("no number `{field}` in {fleet}"));
    let speed_up = number("speed_up")?;
    let met = if speed_up >= SPEED_UP { "met" } else { "NOT MET" };
    Ok(format!(
        "{:<26}{:>14}{:>14}{:>12}   aim\n{:<26}{:>14.1}{:>14.1}{speed_up:>12.2}   at least {SPEED_UP}: {met}\n",
        "fleet, time in s",
        "one worker",
        "two workers",
        "ratio",
        format!("{} records of {} rows", number("records")?, number("rows")?),
        number("one_worker_s")?,
        number("two_workers_s")?,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn ratio_below_its_bound_is_marked() {
        let table_of = |two_s: f64| {
            let fleet = json!({"records": 240, "rows": 2401, "one_worker_s": 100.0, "two_workers_s": two_s, "speed_up": 100.0 / two_s});
            table(&fleet).unwrap()
        };
        assert!(table_of(55.0).ends_with("1.82   at least 1.8: met\n"), "{}", table_of(55.0));
        assert!(table_of(56.0).ends_with("1.79   at least 1.8: NOT MET\n"), "{}", table_of(56.0));
        assert!(table(&json!({})).is_err());
    }
}
