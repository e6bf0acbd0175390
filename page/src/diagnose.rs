//! A record identified and diagnosed.

use anyhow::Result;
use identify::nominal::Identified;
use identify::plant::base::Base;
use identify::{Diagnosis, Effort, Input, Options, Stop, examine_several};
use serde::{Deserialize, Serialize};
use simulation::bad_input;
use simulation::csv_table::text::Source;
use simulation::plant_file::{self, PlantFile};
use simulation::record::{ColumnNames, Format, MeasuredRecord, remarks_on};

use crate::curve::Curve;

/// How the file is read and what it is compared with, by the names of the options of `vsj diagnose`. Empty texts are absent.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Records {
    /// Name of the file in messages.
    pub name: String,
    /// Column of the time and its unit.
    #[serde(default)]
    pub time: String,
    /// Column of the voltage and its unit.
    #[serde(default)]
    pub voltage: String,
    /// Column of the reading and its unit.
    #[serde(default)]
    pub reading: String,
    /// `hold`, `linear` or `stair`.
    pub input: String,
    /// Whether rows are ordered by time.
    #[serde(default)]
    pub sort: bool,
    /// `paper`, `identify`, or the text of a plant file.
    pub plant: String,
    /// `quick`, `normal` or `thorough`.
    pub effort: String,
}

/// An answer with what is drawn of it. Curves are over the time, in the record's unit.
#[derive(Debug, Serialize)]
pub struct Shown {
    /// The answer of the command's `--json`.
    json: String,
    /// What the user should know about how the file was read, one line each.
    remarks: Vec<String>,
    /// The spring that was found, as a plant file.
    plant: String,
    /// Units of time, voltage and reading.
    units: [String; 3],
    /// The curves by name.
    curves: Vec<(&'static str, Curve)>,
}

/// A record that was read.
struct Read {
    measured: MeasuredRecord,
    input: Input,
    remarks: Vec<String>,
}

impl Records {
    fn read(&self, file: &[u8]) -> Result<Read> {
        let given = |text: &String| (!text.is_empty()).then(|| text.clone());
        let columns = ColumnNames {
            time: given(&self.time),
            voltage: given(&self.voltage),
            reading: given(&self.reading),
            ..ColumnNames::default()
        };
        let format = Format { columns, sort: self.sort, ..Format::default() };
        let input = self.input.parse()?;
        let measured = format.read(Source::read(&self.name, file))?;
        let remarks = remarks_on(std::slice::from_ref(&measured))?;
        Ok(Read { measured, input, remarks })
    }
}

impl Read {
    fn identify(&self) -> Result<Identified> {
        ::identify::identify(std::slice::from_ref(&self.measured.record), self.input, &self.measured.units)
    }

    /// The answer to be shown: the command's JSON, the spring, and curves over the times; `time_s` and `voltage_v` are in SI units,
    /// the values of `more` in the reading's unit.
    fn shown(
        self,
        json: String,
        plant: &PlantFile,
        time_s: &[f64],
        voltage_v: &[f64],
        more: &[(&'static str, Vec<f64>)],
    ) -> Result<Shown> {
        let units = &self.measured.units;
        let curve = |values: &[f64], unit: f64| {
            Curve::new(values.len(), |row| time_s[row] / units.time.si, |row| values[row] / unit)
        };
        let mut curves = vec![("voltage", curve(voltage_v, units.voltage.si))];
        curves.extend(more.iter().map(|(name, values)| (*name, curve(values, 1.0))));
        Ok(Shown {
            json,
            plant: format!(
                "# Identified from {}\n{}",
                self.measured.record.name.replace(['\n', '\r'], " "),
                plant.to_toml()?
            ),
            units: [units.time.name.clone(), units.voltage.name.clone(), units.reading.clone()],
            curves,
            remarks: self.remarks,
        })
    }
}

/// Identifies the linear spring of a file.
///
/// # Errors
/// [`simulation::BadInput`] with the file, line, column and what was expected.
pub fn identify(records: &Records, file: &[u8]) -> Result<Shown> {
    let read = records.read(file)?;
    if read.input == Input::Stair {
        bad_input!("--input stair: expected hold or linear; the report's stair is for `vsj diagnose`");
    }
    let found = read.identify()?;
    let json = serde_json::to_string(&found.report)?;
    let course = &found.records[0];
    let model = less(&course.reading, &course.residual);
    let more = [("reading", course.reading.clone()), ("model", model)];
    read.shown(json, &found.plant, &course.time_s, &course.voltage_v, &more)
}

/// Diagnoses a file; `progress` receives the best causes so far.
///
/// # Errors
/// [`simulation::BadInput`] with the file, line, column and what was expected.
pub fn diagnose(records: &Records, file: &[u8], progress: &mut dyn FnMut(&str)) -> Result<Shown> {
    let effort: Effort = records.effort.parse()?;
    let read = records.read(file)?;
    read.input.check(&read.measured.record)?;
    let (name, plant, linear) = match records.plant.as_str() {
        "identify" => {
            let found = read.identify()?;
            ("identify", found.plant, found.linear)
        }
        "paper" => ("paper", plant_file::load_for_host("paper")?, None),
        text => ("plant.toml", plant_file::parse_for_host("plant.toml", text)?, None),
    };
    let options = Options {
        plant: name.to_owned(),
        units: read.measured.units.clone(),
        input: read.input,
        base: Base::new(plant)?,
        effort,
        linear,
        stop: Stop::default(),
    };
    let found = examine_several(std::slice::from_ref(&read.measured.record), &options, |causes| {
        progress(&serde_json::json!({ "causes": causes }).to_string());
    })?;
    let Diagnosis { report, data, baseline, extended, plant, .. } = &found;
    let more = [
        ("reading", data.reading.clone()),
        ("nominal", less(&data.reading, &baseline.residual)),
        ("extended", less(&data.reading, &extended.residual)),
    ];
    read.shown(serde_json::to_string(report)?, plant, &data.time_s, &data.voltage_v, &more)
}

/// What a model predicts: the readings less its residual.
fn less(reading: &[f64], residual: &[f64]) -> Vec<f64> {
    reading.iter().zip(residual).map(|(reading, left)| reading - left).collect()
}
