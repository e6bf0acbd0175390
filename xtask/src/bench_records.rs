//! CPU time of an identification and of a diagnosis, compared with SciPy's linear output-error fits of the same records.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;
use xtask::shell;

/// Largest CPU time of a diagnosis, in s, up to a number of rows.
const LONGEST_S: [(usize, f64); 3] = [(4000, 2.0), (10_000, 8.0), (usize::MAX, 20.0)];

/// Methods, as `records.py` names them.
const METHODS: [&str; 3] = ["identify", "diagnose", "output_error"];

/// One record.
#[derive(Clone, Debug)]
struct Row {
    name: String,
    rows: usize,
    /// CPU time of each method, in s.
    seconds: [f64; 3],
    /// Root mean square error of each method over all rows, in the reading's unit.
    errors: [f64; 3],
}

impl Row {
    fn of(json: &Value) -> Result<Self> {
        let number = |field: &str| json[field].as_f64().with_context(|| format!("no number `{field}` in {json}"));
        let of_each = |what: &str| -> Result<[f64; 3]> {
            let [identify, diagnose, output_error] = METHODS.map(|method| number(&format!("{method}_{what}")));
            Ok([identify?, diagnose?, output_error?])
        };
        let name = json["name"].as_str().context("a record without a name")?.to_owned();
        Ok(Self { name, rows: number("rows")? as usize, seconds: of_each("s")?, errors: of_each("rmse")? })
    }

    /// Largest CPU time of the diagnosis, in s.
    fn longest_s(&self) -> f64 {
        LONGEST_S.iter().find(|(rows, _)| self.rows <= *rows).map_or(f64::INFINITY, |(_, longest_s)| *longest_s)
    }
}

/// Builds `vsj` and measures it and SciPy on all records.
///
/// # Errors
/// If the build or the script fails.
pub(crate) fn measure(python: &Path, target: &Path) -> Result<Value> {
    shell::run(shell::cargo().args(["build", "--release", "-p", "host-sim", "--bin", "vsj"]))?;
    let mut script = shell::command(python);
    script.arg("xtask/bench/records.py").arg(target.join("release/vsj"));
    // CPU times are compared, not numbers of threads.
    shell::json(script.env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1"))
}

/// The table of what [`measure`] returns; a time above its bound is marked and is no error.
///
/// # Errors
/// If a record lacks a number.
pub(crate) fn table(records: &Value) -> Result<String> {
    let rows: Vec<Row> =
        records.as_array().context("no list of records")?.iter().map(Row::of).collect::<Result<_>>()?;
    let mut text = format!(
        "{:<30}{:>7}{:>10}{:>8}{:>10}{:>8}{:>14}   aim\n",
        "CPU time in s", "rows", "identify", "to OE", "diagnose", "to OE", "output error"
    );
    for row in &rows {
        let [identify, diagnose, rival] = row.seconds;
        let met = if diagnose <= row.longest_s() { "met" } else { "NOT MET" };
        let ratios = (identify / rival, diagnose / rival);
        text += &format!(
            "{:<30}{:>7}{identify:>10.2}{:>8.2}{diagnose:>10.2}{:>8.2}{rival:>14.2}   at most {}: {met}\n",
            row.name,
            row.rows,
            ratios.0,
            ratios.1,
            row.longest_s()
        );
    }
    text += &format!("\n{:<37}{:>10}{:>18}{:>22}\n", "root mean square error", "identify", "diagnose", "output error");
    for Row { name, errors: [identify, diagnose, rival], .. } in &rows {
        text += &format!("{name:<37}{identify:>10.4}{diagnose:>18.4}{rival:>22.4}\n");
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn time_above_its_bound_is_marked() {
        let row = |rows: usize, diagnose_s: f64| {
            json!({"name": "record", "rows": rows, "identify_s": 0.1, "diagnose_s": diagnose_s, "output_error_s": 0.5,
                   "identify_rmse": 1.0, "diagnose_rmse": 0.9, "output_error_rmse": 1.1})
        };
        let records = json!([row(2400, 1.9), row(2400, 2.1), row(10_000, 7.0), row(100_000, 21.0)]);
        let table = table(&records).unwrap();
        let marks: Vec<bool> = table.lines().skip(1).take(4).map(|line| line.ends_with("NOT MET")).collect();
        assert_eq!(marks, [false, true, false, true], "{table}");
        assert!(table.contains("at most 8: met"), "{table}");
        assert!(super::table(&json!([{"name": "record"}])).is_err());
    }
}
