//! The answer of `vsj diagnose` as files: a page, plots, residuals, and the diagnosis as JSON.

use std::path::PathBuf;

use anyhow::{Context, Result};

use crate::output::files::{Files, PLANT_FILE};
use crate::output::page::Figure;
use figures::figures;
use identify::Diagnosis;

mod equation;
mod extension;
mod figures;
pub(super) mod number;
mod origin;
mod page;
pub mod panels;
mod plant_file;
pub mod plots;
mod records;
mod residuals;
mod suspects;
mod tables;
pub mod text;

pub use origin::Origin;

/// Writes all files; returns their paths.
///
/// # Errors
/// Returns the errors of [`Files`].
pub fn write(mut files: Files, diagnosis: &Diagnosis, origin: &Origin) -> Result<Vec<PathBuf>> {
    let figures = figures(diagnosis);
    let page = page::page(diagnosis, origin, &figures);
    files.add("report.html", |out| out.write_all(page.as_bytes()))?;
    for Figure { name, chart, .. } in &figures {
        files.add(name, |out| out.write_all(chart.file().as_bytes()))?;
    }
    files.add("residuals.csv", |out| residuals::write(out, diagnosis))?;
    let plant = plant_file::text(diagnosis, &origin.record)?;
    files.add(PLANT_FILE, |out| out.write_all(plant.as_bytes()))?;
    let answer = serde_json::to_string_pretty(&diagnosis.report).context("diagnosis.json")?;
    files.add("diagnosis.json", |out| writeln!(out, "{answer}"))?;
    files.finish()
}
