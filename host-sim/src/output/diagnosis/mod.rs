//! A diagnosis as files: a page to read, plots, residuals, and the answer for scripts.

use std::path::PathBuf;

use anyhow::{Context, Result};

use crate::output::files::Files;
use identify::{Diagnosis, Input};

mod page;
pub mod panels;
pub mod plots;
mod residuals;
mod style;
mod tables;
pub mod text;

/// Where a diagnosis comes from: the page's footer.
#[derive(Clone, Debug)]
pub struct Origin {
    /// The record's name.
    pub record: String,
    /// Its measured column.
    pub column: String,
    /// What the voltage did between its rows.
    pub input: Input,
    /// The command line.
    pub command: String,
}

/// The extended spring, for `vsj stair --plant`.
pub const PLANT_FILE: &str = "plant.toml";

/// A plot of a diagnosis.
struct Figure {
    /// Its file.
    name: &'static str,
    /// What to see on it.
    caption: &'static str,
    svg: String,
}

/// Writes every file and tells their paths.
///
/// # Errors
/// As [`Files`].
pub fn write(mut files: Files, diagnosis: &Diagnosis, origin: &Origin) -> Result<Vec<PathBuf>> {
    let figures = figures(diagnosis);
    let page = page::page(diagnosis, origin, &figures);
    files.add("report.html", |out| out.write_all(page.as_bytes()))?;
    for Figure { name, svg, .. } in &figures {
        files.add(name, |out| out.write_all(svg.as_bytes()))?;
    }
    files.add("residuals.csv", |out| residuals::write(out, diagnosis))?;
    let plant = diagnosis.plant.to_toml()?;
    files.add(PLANT_FILE, |out| {
        write!(out, "# Identified from {}\n{plant}", origin.record.replace(['\n', '\r'], " "))
    })?;
    let answer = serde_json::to_string_pretty(&diagnosis.report).context("diagnosis.json")?;
    files.add("diagnosis.json", |out| writeln!(out, "{answer}"))?;
    files.finish()
}

/// True if the extended simulation differs from the one as it was.
fn is_extended(diagnosis: &Diagnosis) -> bool {
    !diagnosis.extended.model.blocks.is_empty() || !diagnosis.report.take_out.is_empty()
}

fn figures(diagnosis: &Diagnosis) -> Vec<Figure> {
    let figure = |name, caption, svg| Figure { name, caption, svg };
    let (beside, last) = if is_extended(diagnosis) {
        (
            "Readings beside the simulation as it was and the extended one. Both run free: they see the voltage only.",
            "How the extended simulation's whitened residual remembers itself. Chance stays within the band in 95 % of lags.",
        )
    } else {
        (
            "Readings beside the simulation. It runs free: it sees the voltage only.",
            "How the simulation's whitened residual remembers itself. Chance stays within the band in 95 % of lags.",
        )
    };
    vec![
        figure("readings.svg", beside, plots::readings(diagnosis)),
        figure("residual.svg", "Readings less simulation: what is left, over time.", plots::residual(diagnosis)),
        figure(
            "residual_voltage.svg",
            "The same against the commanded voltage. A slope is a gain, a bow a nonlinearity, two branches a memory or a lag.",
            plots::residual_by_voltage(diagnosis),
        ),
        figure("autocorrelation.svg", last, plots::autocorrelation(&diagnosis.report)),
        figure(
            "input_correlation.svg",
            "What it remembers of the voltage's changes. Noise remembers nothing.",
            plots::input_correlation(&diagnosis.report),
        ),
    ]
}
