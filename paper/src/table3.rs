//! Table 3 of the report: the stair experiment, measured and simulated, as printed.

use anyhow::{Context, Result};
use serde::Deserialize;

/// One row as printed. Stiffness on the scale of volts.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Printed {
    /// In s.
    pub time_s: f64,
    /// Commanded, in V.
    pub voltage_v: f64,
    /// The report's measurement.
    pub measured: f64,
    /// The report's simulation with its controller.
    #[serde(rename = "sim_with_controller")]
    pub with: f64,
    /// The report's simulation without it.
    #[serde(rename = "sim_without_controller")]
    pub without: f64,
}

/// The rows, in order of time.
///
/// # Errors
/// If the file that was built in is damaged.
pub fn rows() -> Result<Vec<Printed>> {
    csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(include_str!("../../data/table3_stair.csv").as_bytes())
        .deserialize()
        .collect::<Result<_, _>>()
        .context("data/table3_stair.csv")
}
