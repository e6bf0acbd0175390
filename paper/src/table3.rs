//! Table 3 of the report as printed: the stair experiment, measured and simulated.

use anyhow::{Context, Result};
use serde::Deserialize;

/// One printed row; stiffness is expressed as the equivalent static voltage, in V.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Printed {
    /// Time, in s.
    pub time_s: f64,
    /// Commanded voltage, in V.
    pub voltage_v: f64,
    /// Measured stiffness.
    pub measured: f64,
    /// Simulated stiffness with the report's controller.
    #[serde(rename = "sim_with_controller")]
    pub with: f64,
    /// Simulated stiffness without controller.
    #[serde(rename = "sim_without_controller")]
    pub without: f64,
}

/// All rows, in order of time.
///
/// # Errors
/// If the built-in data file is damaged.
pub fn rows() -> Result<Vec<Printed>> {
    csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(include_str!("../../data/table3_stair.csv").as_bytes())
        .deserialize()
        .collect::<Result<_, _>>()
        .context("data/table3_stair.csv")
}
