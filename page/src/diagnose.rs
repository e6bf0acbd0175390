//! Records of one spring identified and diagnosed.

use anyhow::Result;
use identify::nominal::Identified;
use identify::{Diagnosis, Effort, Input, Options, Stop, examine_several, identify_with_order};
use serde::{Deserialize, Serialize};
use simulation::bad_input;
use simulation::csv_table::text::Source;
use simulation::plant_file::{self, PlantFile};
use simulation::record::{ColumnNames, Format, MeasuredRecord, Record, remarks_on};
use simulation::units::Units;

use crate::curve::Curve;

/// How the files are read and what they are compared with, by the names of the options of `vsj diagnose`. Empty texts are absent.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Records {
    /// The files. Their bytes follow one another.
    pub files: Vec<File>,
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
    /// Order of the model of an identification, 1 to 4; `None` for the smallest that no larger one beats.
    #[serde(default)]
    pub order: Option<usize>,
}

/// One of the files.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name in messages.
    pub name: String,
    /// Size, in bytes.
    pub length: usize,
}

/// An answer with what is drawn of it. Curves are over the time, in the records' unit.
#[derive(Debug, Serialize)]
pub struct Shown {
    /// The answer of the command's `--json`.
    json: String,
    /// What the user should know about how the files were read, one line each.
    remarks: Vec<String>,
    /// The spring that was found, as a plant file.
    plant: String,
    /// Units of time, voltage and reading.
    units: [String; 3],
    /// The curves of each record.
    records: Vec<Drawn>,
}

/// The curves of a record by name.
#[derive(Debug, Serialize)]
struct Drawn {
    name: String,
    curves: Vec<(&'static str, Curve)>,
}

/// A course over the rows of one record, with its name.
type Course<'v> = (&'static str, &'v [f64]);

/// The records that were read.
struct Read {
    records: Vec<Record>,
    units: Units,
    input: Input,
    remarks: Vec<String>,
}

impl Records {
    fn read(&self, mut bytes: &[u8]) -> Result<Read> {
        let given = |text: &String| (!text.is_empty()).then(|| text.clone());
        let columns = ColumnNames {
            time: given(&self.time),
            voltage: given(&self.voltage),
            reading: given(&self.reading),
            ..ColumnNames::default()
        };
        let format = Format { columns, sort: self.sort, ..Format::default() };
        let input = self.input.parse()?;
        let mut measured = Vec::new();
        for File { name, length } in &self.files {
            let Some((file, rest)) = bytes.split_at_checked(*length) else {
                bad_input!("{name}: {} bytes; expected {length}", bytes.len());
            };
            measured.push(format.read(Source::read(name, file))?);
            bytes = rest;
        }
        let Some(MeasuredRecord { units, .. }) = measured.first() else {
            bad_input!("no record; expected one or more");
        };
        let (units, remarks) = (units.clone(), remarks_on(&measured)?);
        let records = measured.into_iter().map(|measured| measured.record).collect();
        Ok(Read { records, units, input, remarks })
    }
}

impl Read {
    fn identify(&self) -> Result<Identified> {
        ::identify::identify(&self.records, self.input, &self.units)
    }

    /// The answer to be shown: the command's JSON, the spring, and the curves of each record.
    fn shown(self, json: String, plant: &PlantFile, records: Vec<Drawn>) -> Result<Shown> {
        let names: Vec<&str> = self.records.iter().map(|record| record.name.as_str()).collect();
        Ok(Shown {
            json,
            plant: format!("# Identified from {}\n{}", names.join(", ").replace(['\n', '\r'], " "), plant.to_toml()?),
            units: [self.units.time.name, self.units.voltage.name, self.units.reading],
            records,
            remarks: self.remarks,
        })
    }
}

impl Drawn {
    /// The curves of a record over its times; `time_s` and the course `voltage` are in SI units, others in the reading's unit.
    fn new(name: &str, units: &Units, time_s: &[f64], courses: &[Course]) -> Self {
        let curve = |(name, values): &Course| {
            let unit = if *name == "voltage" { units.voltage.si } else { 1.0 };
            (*name, Curve::new(values.len(), |row| time_s[row] / units.time.si, |row| values[row] / unit))
        };
        Self { name: name.to_owned(), curves: courses.iter().map(curve).collect() }
    }
}

/// Identifies the linear spring of the files.
///
/// # Errors
/// [`simulation::BadInput`] with the file, line, column and what was expected.
pub fn identify(records: &Records, files: &[u8]) -> Result<Shown> {
    let read = records.read(files)?;
    if read.input == Input::Stair {
        bad_input!("--input stair: expected hold or linear; the report's stair is for `vsj diagnose`");
    }
    let found = match records.order {
        Some(order) => identify_with_order(&read.records, order, read.input, &read.units)?,
        None => read.identify()?,
    };
    let json = serde_json::to_string(&found.report)?;
    let drawn = found.records.iter().map(|course| {
        let model = less(&course.reading, &course.residual);
        let courses: [Course; 3] = [("voltage", &course.voltage_v), ("reading", &course.reading), ("model", &model)];
        Drawn::new(&course.name, &read.units, &course.time_s, &courses)
    });
    let drawn = drawn.collect();
    read.shown(json, &found.plant, drawn)
}

/// Diagnoses the files; `progress` receives the best causes so far. Once `stop` is requested, the answer is the best so far.
///
/// # Errors
/// [`simulation::BadInput`] with the file, line, column and what was expected.
pub fn diagnose(records: &Records, files: &[u8], stop: &Stop, progress: &mut dyn FnMut(&str)) -> Result<Shown> {
    let effort: Effort = records.effort.parse()?;
    let mut read = records.read(files)?;
    read.records.iter().try_for_each(|record| read.input.check(record))?;
    let options =
        Options { units: read.units.clone(), input: read.input, effort, stop: stop.clone(), ..Options::default() };
    let options = match records.plant.as_str() {
        "identify" => options.judging(read.identify()?)?,
        "paper" => options.judging_file("paper", plant_file::load_for_host("paper")?)?,
        text => options.judging_file("plant.toml", plant_file::parse_for_host("plant.toml", text)?)?,
    };
    read.remarks.extend(options.remarks());
    let found = examine_several(&read.records, &options, |causes| {
        progress(&serde_json::json!({ "causes": causes }).to_string());
    })?;
    let Diagnosis { report, data, baseline, extended, plant, .. } = &found;
    let (nominal, extended) = (less(&data.reading, &baseline.residual), less(&data.reading, &extended.residual));
    let times: Vec<f64> = (0..data.rows()).map(|row| data.place(row).1).collect();
    let drawn = data.rows_of_records().into_iter().zip(&read.records).map(|(rows, record)| {
        let courses: [Course; 4] =
            [("voltage", &data.voltage_v), ("reading", &data.reading), ("nominal", &nominal), ("extended", &extended)];
        let courses = courses.map(|(name, values)| (name, &values[rows.clone()]));
        Drawn::new(&record.name, &read.units, &times[rows], &courses)
    });
    let drawn = drawn.collect();
    read.shown(serde_json::to_string(report)?, plant, drawn)
}

/// What a model predicts: the readings less its residual.
fn less(reading: &[f64], residual: &[f64]) -> Vec<f64> {
    reading.iter().zip(residual).map(|(reading, left)| reading - left).collect()
}
