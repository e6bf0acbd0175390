//! Identification, diagnosis and plan: records in, the command's JSON out, with the courses over time that it does not contain.

use std::ops::Range;
use std::time::Duration;

use ::identify::plan::{Basis, Request};
use ::identify::{Diagnosis, Effort, Input, Options, Stop, examine_several, identify_with_order};
use anyhow::Result;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use simulation::bad_input;
use simulation::plant_file::{self, PlantFile};
use simulation::record::MeasuredRecord;

use crate::interrupt;
use crate::records::{self, Given, Records, copied};

/// Named columns of numbers, each with one value per reading.
type Course = Vec<(&'static str, Vec<f64>)>;

/// An answer: its JSON, a plant file, remarks, and the courses of each record by name.
struct Answer {
    json: String,
    plant: String,
    /// Unit of the readings.
    unit: String,
    remarks: Vec<String>,
    courses: Vec<(String, Course)>,
}

impl Answer {
    fn into_python(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let answer = PyDict::new(py);
        answer.set_item("json", self.json)?;
        answer.set_item("plant", self.plant)?;
        answer.set_item("unit", self.unit)?;
        answer.set_item("remarks", self.remarks)?;
        let courses = self.courses.into_iter().map(|(name, course)| Ok((name, arrays(py, course)?)));
        answer.set_item("courses", courses.collect::<PyResult<Vec<_>>>()?)?;
        Ok(answer)
    }
}

fn arrays(py: Python<'_>, course: Course) -> PyResult<Bound<'_, PyDict>> {
    let arrays = PyDict::new(py);
    for (name, values) in course {
        let array: Bound<'_, PyArray1<f64>> = values.into_pyarray(py);
        arrays.set_item(name, array)?;
    }
    Ok(arrays)
}

/// The text of a plant file, with the records that it was identified from.
fn plant_text(plant: &PlantFile, records: &Records) -> Result<String> {
    let names: Vec<&str> = records.measured.iter().map(|measured| measured.record.name.as_str()).collect();
    Ok(format!("# Identified from {}\n{}", names.join(", ").replace(['\n', '\r'], " "), plant.to_toml()?))
}

/// Identifies the linear spring of records, with a model of `order` if one is given.
#[pyfunction]
#[pyo3(signature = (records, options, order = None))]
pub(crate) fn identify<'py>(
    py: Python<'py>,
    records: Vec<Given<'py>>,
    options: records::Options,
    order: Option<i64>,
) -> PyResult<Bound<'py, PyDict>> {
    let records = copied(records);
    let answer = interrupt::run(py, &Stop::default(), move || {
        let records = options.open(&records)?;
        if records.input == Input::Stair {
            bad_input!("--input stair: expected hold or linear; the report's stair is for `vsj diagnose`");
        }
        let units = records.measured[0].units.clone();
        let found = match order {
            Some(order) => {
                let Ok(order) = usize::try_from(order) else { bad_input!("order {order}: expected 1 or more") };
                identify_with_order(&records.rows(), order, records.input, &units)?
            }
            None => ::identify::identify(&records.rows(), records.input, &units)?,
        };
        let json = serde_json::to_string(&found.report)?;
        let plant = plant_text(&found.plant, &records)?;
        let course = |it: ::identify::nominal::Course| {
            let model = it.reading.iter().zip(&it.residual).map(|(reading, residual)| reading - residual).collect();
            let columns = vec![
                ("time_s", it.time_s),
                ("voltage_v", it.voltage_v),
                ("reading", it.reading),
                ("model", model),
                ("residual", it.residual),
                ("held_out", it.held_out),
            ];
            (it.name, columns)
        };
        let courses = found.records.into_iter().map(course).collect();
        Ok(Answer { json, plant, unit: units.reading, remarks: records.remarks, courses })
    })?;
    answer.into_python(py)
}

/// The nominal spring of a diagnosis: `paper`, `identify`, a plant file's path, or its name and text.
#[derive(FromPyObject)]
pub(crate) enum Plant {
    Text((String, String)),
    Named(String),
}

/// Diagnoses records.
#[pyfunction]
pub(crate) fn diagnose<'py>(
    py: Python<'py>,
    records: Vec<Given<'py>>,
    options: records::Options,
    plant: Plant,
    effort: String,
    within: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let records = copied(records);
    let stop = deadline(within).map_err(crate::error::exception)?;
    let answer = interrupt::run(py, &stop.clone(), move || {
        let effort: Effort = effort.parse()?;
        let mut records = options.open(&records)?;
        let rows = records.rows();
        rows.iter().try_for_each(|record| records.input.check(record))?;
        let units = records.measured[0].units.clone();
        let options = Options { units, input: records.input, effort, stop, ..Options::default() };
        let options = match plant {
            Plant::Named(name) if name == "identify" => {
                let identified = ::identify::identify(&rows, records.input, &options.units)?;
                options.judging(identified)?
            }
            Plant::Named(name) => options.judging_file(&name, plant_file::load_for_host(&name)?)?,
            Plant::Text((name, text)) => options.judging_file(&name, plant_file::parse_for_host(&name, &text)?)?,
        };
        records.remarks.extend(options.remarks());
        let found = examine_several(&rows, &options, |_| {})?;
        let json = serde_json::to_string(&found.report)?;
        let plant = plant_text(&found.plant, &records)?;
        let courses = courses(&found, &records);
        let unit = records.measured[0].units.reading.clone();
        Ok(Answer { json, plant, unit, remarks: records.remarks, courses })
    })?;
    answer.into_python(py)
}

/// The courses of a diagnosis, one for each record with its own times.
fn courses(found: &Diagnosis, records: &Records) -> Vec<(String, Course)> {
    let data = &found.data;
    let less = |residual: &[f64]| -> Vec<f64> {
        data.reading.iter().zip(residual).map(|(reading, left)| reading - left).collect()
    };
    let time_s: Vec<f64> = (0..data.rows()).map(|row| data.place(row).1).collect();
    let columns: [(&str, &[f64]); 9] = [
        ("time_s", &time_s),
        ("voltage_v", &data.voltage_v),
        ("reading", &data.reading),
        ("baseline", &less(&found.baseline.residual)),
        ("extended", &less(&found.extended.residual)),
        ("baseline_residual", &found.baseline.residual),
        ("residual", &found.extended.residual),
        ("baseline_held_out", &found.held_out[0]),
        ("held_out", &found.held_out[1]),
    ];
    let of_record = |(rows, measured): (Range<usize>, &MeasuredRecord)| {
        let of = |values: &[f64]| values.get(rows.clone()).unwrap_or_default().to_vec();
        (measured.record.name.clone(), columns.iter().map(|(name, values)| (*name, of(values))).collect())
    };
    data.rows_of_records().into_iter().zip(&records.measured).map(of_record).collect()
}

/// A stop after `within` seconds.
fn deadline(within: Option<f64>) -> Result<Stop> {
    let Some(seconds) = within else { return Ok(Stop::default()) };
    match Duration::try_from_secs_f64(seconds) {
        Ok(time) if seconds > 0.0 => Ok(Stop::after(time)),
        _ => bad_input!("--within {seconds}: expected a positive time in s"),
    }
}

/// Plans the next experiment from the JSON of a diagnosis; `name` is what messages call it.
#[pyfunction]
pub(crate) fn plan<'py>(
    py: Python<'py>,
    diagnosis: String,
    name: String,
    minutes: Option<f64>,
    limit_v: Option<f64>,
    slew_v_per_s: Option<f64>,
) -> PyResult<(String, Bound<'py, PyDict>)> {
    let (json, course) = interrupt::run(py, &Stop::default(), move || {
        let request = Request { minutes, limit_v, slew_v_per_s };
        request.check()?;
        let plan = ::identify::plan::plan(&Basis::from_json(&name, &diagnosis)?, &request, &name)?;
        let course: Course = vec![
            ("time_s", plan.commands.iter().map(|command| command.time_s).collect()),
            ("voltage_v", plan.commands.iter().map(|command| command.voltage_v).collect()),
        ];
        Ok((serde_json::to_string(&plan)?, course))
    })?;
    Ok((json, arrays(py, course)?))
}
