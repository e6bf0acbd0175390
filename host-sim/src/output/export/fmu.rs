//! Archives of co-simulation units, and the answer of `vsj export fmu`.

use std::io::{Cursor, Write};

use anyhow::Result;
use serde::Serialize;
use vsj_fmu::{Kind, Unit, Version, unit};
use zip::write::SimpleFileOptions;
use zip::{DateTime, ZipWriter};

use super::library::Library;
use crate::output::files::Files;

/// The licences of the library; those of its dependencies are in every release.
const LICENCES: [(&str, &str); 2] = [
    ("LICENSE-APACHE", include_str!("../../../../LICENSE-APACHE")),
    ("LICENSE-MIT", include_str!("../../../../LICENSE-MIT")),
];

/// Units to be written.
#[derive(Debug)]
pub struct Units<'a> {
    /// Spring and settings; the kind is replaced.
    pub unit: &'a Unit,
    /// Text of the plant file.
    pub plant_text: &'a str,
    /// One library for each platform.
    pub libraries: &'a [Library],
    /// Kind and version of each unit.
    pub wanted: Vec<(Kind, Version)>,
}

/// The answer of `vsj export fmu --json`.
#[derive(Debug, Serialize)]
pub struct Answer {
    schema: u32,
    units: Vec<Written>,
    platforms: Vec<&'static str>,
    tick_s: f64,
    not_simulated: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Written {
    file: String,
    unit: &'static str,
    fmi: u32,
    variables: usize,
}

/// Adds one file for each unit.
///
/// # Errors
/// If a file cannot be written.
pub fn write(units: &Units, files: &mut Files, not_simulated: Vec<String>) -> Result<Answer> {
    let mut written = Vec::new();
    for &(kind, version) in &units.wanted {
        let unit = Unit { kind, ..units.unit.clone() };
        let file = format!("{}.fmi{}.fmu", kind.identifier(), version.number());
        let archive = archive(&unit, version, units)?;
        files.add(&file, |out| out.write_all(&archive))?;
        let variables = vsj_fmu::variables::variables(&unit).len();
        written.push(Written { file, unit: kind.name(), fmi: version.number(), variables });
    }
    Ok(Answer {
        schema: 1,
        units: written,
        platforms: units.libraries.iter().map(|library| library.platform.name).collect(),
        tick_s: 1.0 / units.unit.options.rate_hz,
        not_simulated,
    })
}

/// The bytes of a unit: the same for the same spring, settings and libraries.
fn archive(unit: &Unit, version: Version, units: &Units) -> Result<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().last_modified_time(DateTime::default());
    let mut add = |path: &str, bytes: &[u8]| -> Result<()> {
        zip.start_file(path, options)?;
        Ok(zip.write_all(bytes)?)
    };
    add("modelDescription.xml", unit.description(version).as_bytes())?;
    for Library { platform, bytes } in units.libraries {
        let folder = if version == Version::Two { platform.in_fmi_2 } else { platform.name };
        add(&format!("binaries/{folder}/{}{}", unit.kind.identifier(), platform.ending), bytes)?;
    }
    add(&format!("resources/{}", unit::SETTINGS), unit.settings_file()?.as_bytes())?;
    add(&format!("resources/{}", unit::PLANT), units.plant_text.as_bytes())?;
    for (name, text) in LICENCES {
        add(&format!("documentation/licenses/{name}"), text.as_bytes())?;
    }
    Ok(zip.finish()?.into_inner())
}

/// The answer for a terminal.
pub fn text(answer: &Answer) -> String {
    let list = |unit: &Written| format!("{:<28} FMI {}.0, {} variables\n", unit.file, unit.fmi, unit.variables);
    let units: String = answer.units.iter().map(list).collect();
    format!("{units}tick {} s, for {}\n", answer.tick_s, answer.platforms.join(", "))
}
