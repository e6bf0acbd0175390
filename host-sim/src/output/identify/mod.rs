//! The answer of `vsj identify`: text, a page with plots, JSON, and the spring as a plant file.

use std::path::PathBuf;

use anyhow::{Context, Result};
use identify::Identified;
use simulation::units::Units;

use crate::output::files::{Files, PLANT_FILE};

mod page;
mod plots;
mod table;
pub mod text;

/// The origin of an identification.
#[derive(Clone, Debug)]
pub struct Origin {
    /// The command line that was run.
    pub command: String,
}

/// Name of the file with the answer.
pub const ANSWER_FILE: &str = "identify.json";

/// Writes all files; returns their paths.
///
/// # Errors
/// Returns the errors of [`Files`].
pub fn write(mut files: Files, identified: &Identified, units: &Units, origin: &Origin) -> Result<Vec<PathBuf>> {
    let figures = plots::figures(identified, units);
    let page = page::page(identified, units, origin, &figures);
    files.add("report.html", |out| out.write_all(page.as_bytes()))?;
    let names: Vec<String> = identified.records.iter().map(|record| record.name.replace(['\n', '\r'], " ")).collect();
    let plant = identified.plant.to_toml()?;
    files.add(PLANT_FILE, |out| write!(out, "# Identified from {}\n{plant}", names.join(", ")))?;
    let answer = serde_json::to_string_pretty(&identified.report).context(ANSWER_FILE)?;
    files.add(ANSWER_FILE, |out| writeln!(out, "{answer}"))?;
    files.finish()
}
