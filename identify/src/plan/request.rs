//! What a plan is computed from, and what the user allows, checked.

use anyhow::Result;
use serde::Deserialize;
use simulation::bad_input;
use simulation::bad_input::{BadInput, number};
use simulation::plant_file::PlantFile;
use simulation::units::Unit;

use crate::answer::SCHEMA;
use crate::hypotheses::{Experiment, Rival};
use crate::plan::candidate::Frame;

/// The parts of a diagnosis, as `vsj diagnose --json` prints it, that a plan needs.
#[derive(Clone, Debug, Deserialize)]
pub struct Basis {
    /// Version of the JSON format.
    pub schema: u32,
    /// The conclusion of the diagnosis, in lower case.
    pub verdict: String,
    /// Sets of causes that the record cannot reject.
    #[serde(default)]
    pub alternatives: Vec<Vec<String>>,
    /// The best sets of causes with their fits, the best first.
    #[serde(default)]
    pub rivals: Vec<Rival>,
    /// Causes that come closest to a finding.
    #[serde(default)]
    pub suspects: Vec<Suspect>,
    /// The experiment behind the diagnosis.
    pub experiment: Option<Experiment>,
}

/// What a plan needs of a suspect; its parameters are those of the rival with its causes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Suspect {
    /// Cause code.
    pub cause: String,
    /// The other causes of the set in which it comes closest to a finding.
    pub with: Vec<String>,
    /// What the set's score lacks to that of the best set, in nats.
    pub nats_short: f64,
    /// Probability of the cause, if the best set contains it.
    #[serde(default)]
    pub probability: Option<f64>,
}

/// What the user allows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Request {
    /// Duration, in minutes; `None` for 4 minutes of a spring with the paper's time constant.
    pub minutes: Option<f64>,
    /// Largest magnitude of the voltage, in V, or in the unit of a command that is no voltage; `None` for the range of the record.
    pub limit_v: Option<f64>,
    /// Largest rate of change of the voltage, in V/s, or in that unit per s; `None` for steps.
    pub slew_v_per_s: Option<f64>,
}

/// Largest voltage of any amplifier, in V: that of the tick's plant files.
const AMPLIFIER_LIMIT_V: f64 = 1000.0;
/// Largest command that is no voltage, in its unit.
const MOST_OF_OTHER_UNIT: f64 = 1e9;
/// Duration in normalised s unless the user asks for another: 4 minutes for the paper's spring.
const DEFAULT_DURATION_S: f64 = 240.0;
/// Fewest readings of an experiment that a diagnosis can use.
const FEWEST_ROWS: f64 = 40.0;
/// Most readings of an experiment.
const MOST_ROWS: f64 = 1e7;

impl Basis {
    /// Reads the parts of a diagnosis that a plan needs.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] with the line and column of what is no diagnosis; `name` is what the message calls the
    /// file.
    pub fn from_json(name: &str, json: &str) -> Result<Self> {
        serde_json::from_str(json).map_err(|error| {
            let what = error.to_string();
            // The position is at the front of the message.
            let what = what.rsplit_once(" at line ").map_or(what.as_str(), |(what, _)| what);
            let (line, column) = (error.line(), error.column());
            BadInput(format!("{name}, line {line}, column {column}: {what}; expected the JSON of `vsj diagnose`"))
                .into()
        })
    }

    /// Returns the experiment behind the diagnosis.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] for another version of the format, or a diagnosis without its experiment; `name` is what
    /// the message calls the file.
    pub fn experiment(&self, name: &str) -> Result<&Experiment> {
        if self.schema != SCHEMA {
            bad_input!("{name}: schema {}; expected {SCHEMA}, the diagnosis of this version of vsj", self.schema);
        }
        let Some(experiment) = &self.experiment else {
            bad_input!("{name}: no field `experiment`; expected the JSON of `vsj diagnose` of this version");
        };
        Ok(experiment)
    }
}

impl Request {
    /// Checks what needs no experiment.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] with the option, its value and what was expected.
    pub fn check(&self) -> Result<()> {
        for (option, value) in
            [("--minutes", self.minutes), ("--limit-v", self.limit_v), ("--slew-v-per-s", self.slew_v_per_s)]
        {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                bad_input!("{option} {value}: expected a number above 0");
            }
        }
        Ok(())
    }

    /// Returns the frame of the schedules that this request allows after an experiment with a nominal spring; a command in another unit
    /// than volts has it in messages.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] with the option, its value and the allowed range.
    pub(super) fn frame(&self, experiment: &Experiment, command: &Unit, plant: &PlantFile) -> Result<Frame> {
        self.check()?;
        let unit = if command.is_voltage() { "V" } else { &command.name };
        let second_s = experiment.coordinates.second_s;
        let duration_s = self.minutes.map_or(DEFAULT_DURATION_S * second_s, |minutes| 60.0 * minutes);
        // A time between readings that is computed from decimal times is off by a rounding error.
        let rows = (duration_s / experiment.sample_s + 1e-6).floor();
        if !(FEWEST_ROWS..=MOST_ROWS).contains(&rows) {
            let [least, most] = [FEWEST_ROWS, MOST_ROWS].map(|rows| number(rows * experiment.sample_s / 60.0));
            bad_input!(
                "--minutes {}: expected {least} to {most}, {FEWEST_ROWS} to {MOST_ROWS} readings that are {} s apart",
                number(duration_s / 60.0),
                number(experiment.sample_s)
            );
        }
        let (mut low_v, mut high_v) = (experiment.lowest_v.min(0.0), experiment.highest_v.max(0.0));
        let widest = low_v.abs().max(high_v);
        // A record at 0 V names no range; one beyond the amplifiers of this project has an amplifier of its own.
        let most_v = widest.max(if command.is_voltage() { AMPLIFIER_LIMIT_V } else { MOST_OF_OTHER_UNIT });
        if let Some(limit_v) = self.limit_v {
            if !(limit_v > 0.0 && limit_v <= most_v) {
                bad_input!("--limit-v {}: expected above 0, at most {} {unit}", number(limit_v), number(most_v));
            }
            // The sign of the record's voltages stays.
            let scale = if widest > 0.0 { limit_v / widest } else { 0.0 };
            (low_v, high_v) = if widest > 0.0 { (low_v * scale, high_v * scale) } else { (0.0, limit_v) };
        }
        if low_v == high_v {
            bad_input!("--limit-v: expected, because the voltage of the record is always 0 {unit}");
        }
        let slew = self.slew_v_per_s.unwrap_or(f64::INFINITY);
        let volt_v = experiment.coordinates.volt_v;
        let frame = Frame {
            rows: rows as usize,
            sample_s: experiment.sample_s / second_s,
            tau_rows: (time_constant(experiment, plant) / experiment.sample_s).max(1.0),
            low_v: low_v / volt_v,
            high_v: high_v / volt_v,
            slew_v_per_row: slew * experiment.sample_s / volt_v,
        };
        if frame.rows_to_zero() > frame.rows / 4 {
            let least = 4.0 * (high_v - low_v) / duration_s;
            bad_input!(
                "--slew-v-per-s {}: expected at least {} {unit}/s, a quarter of the time for the whole range",
                number(slew),
                number(least)
            );
        }
        Ok(frame)
    }
}

/// Returns the first time constant of the spring, in s; 0 if it has none.
fn time_constant(experiment: &Experiment, plant: &PlantFile) -> f64 {
    let nominal = plant.relaxation.tau_s.first().copied().unwrap_or(0.0);
    experiment.coordinates.start.map_or(nominal, |start| start.tau_s * experiment.coordinates.second_s)
}
