//! Records for other tools: the CSV that `vsj diagnose` reads, the true values as JSON, and the host tools' record
//! type.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::{Value, json};
use simulation::record::{Record, Row};

use super::record::LabelledRecord;

impl LabelledRecord {
    /// The record as [`Record::parse`] reads it from [`csv`](Self::csv).
    pub fn record(&self) -> Record {
        let rows = self.schedule.rows().zip(&self.readings.read).enumerate();
        let row = |(k, ((time_s, voltage_v), &read)): (usize, ((f64, f64), &f64))| Row {
            line: k + 2,
            time_s,
            voltage_v,
            measured: Some(read),
        };
        Record { name: format!("seed-{}", self.seed), rows: rows.map(row).collect() }
    }

    /// The CSV with columns `time_s,voltage_v,stiffness`, every number to its last bit.
    pub fn csv(&self) -> String {
        let mut text = String::from("time_s,voltage_v,stiffness\n");
        for ((time_s, voltage_v), read) in self.schedule.rows().zip(&self.readings.read) {
            writeln!(text, "{time_s},{voltage_v},{read}").expect("a string takes anything");
        }
        text
    }

    /// The true values as JSON. `expected` is the noise-free reading of every row, in V.
    pub fn sidecar(&self) -> Value {
        json!({"seed": self.seed, "hidden": self.truths(), "noise": self.noise, "floor_rmse": self.floor_rmse(),
            "expected": self.readings.expected})
    }

    /// Writes `NAME.csv` and `NAME.json` to `folder`, which is made if it is missing, and returns their paths.
    ///
    /// # Errors
    /// The folder or a file cannot be written.
    pub fn write(&self, folder: &Path, name: &str) -> Result<[PathBuf; 2]> {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let paths = [folder.join(format!("{name}.csv")), folder.join(format!("{name}.json"))];
        for (path, text) in paths.iter().zip([self.csv(), format!("{}\n", self.sidecar())]) {
            fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(paths)
    }
}

#[cfg(test)]
mod tests {
    use simulation::record::MEASURED;

    use super::*;
    use crate::cause::Cause;
    use crate::record::Recipe;

    #[test]
    fn parsing_the_csv_gives_the_record_to_the_bit() {
        let hidden = Recipe { rows: 600, uneven: true, ..Recipe::of(&[Cause::Drift]) }.draw(3);
        let record = Record::parse(&format!("seed-{}", hidden.seed), &hidden.csv(), MEASURED).unwrap();
        assert_eq!(record, hidden.record());
    }
}
