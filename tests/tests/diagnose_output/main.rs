//! `vsj diagnose`: its files, its messages, and its verdicts on poor records.

mod files;
mod records;
mod several;
mod table3;

use std::fmt::Write;
use std::fs;
use std::path::Path;

use end_to_end::vsj::{run, text};
use random_numbers::Lcg32;
use tempfile::TempDir;

/// Files that `--out` writes.
const FILES: [&str; 9] = [
    "autocorrelation.svg",
    "diagnosis.json",
    "input_correlation.svg",
    "plant.toml",
    "readings.svg",
    "report.html",
    "residual.svg",
    "residual_voltage.svg",
    "residuals.csv",
];

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

/// A record of the paper's spring on plateaus of 10 s, ten rows per second, with uniform noise of +-0.5 V and
/// `error(row)`.
fn papers(rows: u32, error: impl Fn(u32) -> f64) -> String {
    let mut csv = "time_s,voltage_v,stiffness\n".to_owned();
    let (mut relaxed, mut numbers) = (0.0, Lcg32::new(1));
    for row in 0..rows {
        let voltage = [0.0, 400.0, 150.0, 500.0][row as usize / 100 % 4];
        let reading =
            relaxed + (voltage - relaxed) / 11.0 + f64::from(numbers.draw()) / f64::from(u32::MAX) - 0.5 + error(row);
        writeln!(csv, "{},{voltage},{reading}", 0.1 * f64::from(row)).expect("a string takes anything");
        relaxed += (voltage - relaxed) * (1.0 - (-0.1f64 / 5.5).exp());
    }
    csv
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Runs `vsj` with `arguments` that it rejects; exit code and the one line on stderr.
fn rejected(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = run(folder, arguments);
    assert!(output.stdout.is_empty(), "{arguments:?} printed {}", text(&output.stdout));
    let error = text(&output.stderr);
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    (output.status.code(), error)
}
