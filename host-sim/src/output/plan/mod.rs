//! The answer of `vsj plan`: text, JSON, the schedule as CSV, plots of the schedule and of the predicted readings.

use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::{Context, Result};
use identify::plan::Plan;

use crate::output::files::{Files, PLANT_FILE};

mod plots;
pub mod text;

/// Name of the file with the schedule, for `--input`.
pub const SCHEDULE_FILE: &str = "schedule.csv";

/// Writes all files; returns their paths. `spring` is the plant file of the spring that the diagnosis compared its record with.
///
/// # Errors
/// Returns the errors of [`Files`].
pub fn write(mut files: Files, plan: &Plan, spring: &str, command: &str) -> Result<Vec<PathBuf>> {
    files.add(SCHEDULE_FILE, |out| schedule(out, plan, command))?;
    files.add(PLANT_FILE, |out| out.write_all(spring.as_bytes()))?;
    let answer = serde_json::to_string_pretty(plan).context("plan.json")?;
    files.add("plan.json", |out| writeln!(out, "{answer}"))?;
    for (name, svg) in plots::figures(plan) {
        files.add(name, |out| out.write_all(svg.as_bytes()))?;
    }
    files.finish()
}

/// Writes the schedule as CSV: each voltage is held until the next row.
fn schedule(out: &mut dyn Write, plan: &Plan, command: &str) -> io::Result<()> {
    writeln!(out, "# {}; each voltage is held until the next row", command.replace(['\n', '\r'], " "))?;
    out.write_all(plan.csv().as_bytes())
}
