//! Records as files, for other tools: the CSV that `vsj diagnose` reads and, beside it, the truth as JSON.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::{Value, json};

use super::record::Hidden;

impl Hidden {
    /// The CSV, as exact as numbers are.
    pub fn csv(&self) -> String {
        let mut text = String::from("time_s,voltage_v,stiffness\n");
        for ((time_s, voltage_v), read) in self.schedule.rows().zip(&self.readings.read) {
            writeln!(text, "{time_s},{voltage_v},{read}").expect("a string takes anything");
        }
        text
    }

    /// What is true about it. `expected` is what a simulation of the true spring says, row by row.
    pub fn sidecar(&self) -> Value {
        json!({"seed": self.seed, "hidden": self.truths(), "noise": self.noise, "floor_rmse": self.floor_rmse(),
            "expected": self.readings.expected})
    }

    /// Writes `NAME.csv` and `NAME.json` to a folder; their paths.
    ///
    /// # Errors
    /// A folder or file that cannot be written.
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
    use simulation::record::{MEASURED, Record};

    use crate::hidden::cause::Cause;
    use crate::hidden::record::Recipe;

    #[test]
    fn the_file_is_the_record_to_the_bit() {
        let hidden = Recipe { rows: 600, uneven: true, ..Recipe::of(&[Cause::Drift]) }.draw(3);
        let record = Record::parse(&format!("seed-{}", hidden.seed), &hidden.csv(), MEASURED).unwrap();
        assert_eq!(record, hidden.record());
    }
}
