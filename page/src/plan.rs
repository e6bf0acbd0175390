//! The next experiment after a diagnosis, as `vsj plan` computes it.

use anyhow::Result;
use identify::plan::{self, Basis, Request};
use serde::{Deserialize, Serialize};
use simulation::bad_input;

use crate::curve::Curve;

/// Name of the diagnosis in messages, which is that of the file that the page saves.
const NAME: &str = "diagnosis.json";

/// What the user allows, by the names of the options of `vsj plan`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Planned {
    /// Duration, in minutes; absent for the default.
    pub minutes: Option<f64>,
    /// Largest magnitude of the voltage, in V; absent for that of the record.
    pub limit_v: Option<f64>,
    /// Largest rate of change of the voltage, in V/s; absent for steps.
    pub slew_v_per_s: Option<f64>,
}

/// A plan with what is drawn of it. Curves are over the time in s.
#[derive(Debug, Serialize)]
pub struct Shown {
    /// The answer of `vsj plan --json`.
    json: String,
    /// The schedule as CSV, which `vsj stair --input` reads.
    csv: String,
    /// Commanded voltage, in V.
    schedule: Curve,
    /// Readings that each set of causes predicts, by the names of the causes.
    responses: Vec<(Vec<String>, Curve)>,
    /// Unit of the readings.
    unit: String,
}

/// Plans an experiment from the JSON of a diagnosis.
///
/// # Errors
/// [`simulation::BadInput`] for a text that is no diagnosis, one that cannot be planned from, and values out of range.
pub fn plan(planned: &Planned, diagnosis: &[u8]) -> Result<Shown> {
    let Planned { minutes, limit_v, slew_v_per_s } = *planned;
    let request = Request { minutes, limit_v, slew_v_per_s };
    request.check()?;
    let Ok(diagnosis) = std::str::from_utf8(diagnosis) else {
        bad_input!("{NAME}: not UTF-8; expected the JSON of `vsj diagnose`");
    };
    let plan = plan::plan(&Basis::from_json(NAME, diagnosis)?, &request, NAME)?;
    let commands = &plan.commands;
    let responses = plan.responses.iter().map(|of| {
        let curve = Curve::new(of.reading.len(), |row| of.time_s[row], |row| of.reading[row]);
        (of.causes.clone(), curve)
    });
    Ok(Shown {
        json: serde_json::to_string(&plan)?,
        csv: plan.csv(),
        schedule: Curve::new(commands.len(), |row| commands[row].time_s, |row| commands[row].voltage_v),
        responses: responses.collect(),
        unit: plan.reading_unit.clone(),
    })
}
