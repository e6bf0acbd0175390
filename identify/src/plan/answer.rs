//! The data types of a plan. Names of fields are part of the interface.

use serde::Serialize;
use simulation::units::Unit;

/// The next experiment and what it is predicted to show.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// Path of the schedule that was written; `None` if none was.
    pub schedule: Option<String>,
    /// The sets of causes that the experiment decides between, the likeliest first; empty if nothing is undecided.
    pub decides: Vec<Vec<String>>,
    /// Predicted probability that the experiment rejects all sets but the true one; `None` if nothing is undecided.
    pub probability: Option<f64>,
    /// Duration, in minutes.
    pub minutes: f64,
    /// Lowest and highest voltage, in V.
    pub range_v: [f64; 2],
    /// The suspects of a diagnosis that explains nothing, as far as a voltage shows them, in its order.
    pub suspects: Vec<Suspected>,
    /// The experiment compared with each pair of sets.
    pub separations: Vec<Separation>,
    /// The schedule part by part.
    pub parts: Vec<Part>,
    /// 95 % intervals before and after the experiment, of the parameters of the likeliest set of causes.
    pub intervals: Vec<Sharper>,
    /// Commanded voltages, each held until the next; the last is at the end.
    #[serde(skip)]
    pub commands: Vec<Command>,
    /// Predicted readings of every set of causes.
    #[serde(skip)]
    pub responses: Vec<Response>,
    /// Name of the reading's unit.
    #[serde(skip)]
    pub reading_unit: String,
    /// Unit of the commanded voltage in the record, in which a user reads it.
    #[serde(skip)]
    pub command_unit: Unit,
    /// What limits the plan, in sentences.
    pub remarks: Vec<String>,
}

impl Plan {
    /// Returns the schedule as CSV with the columns `time_s,voltage_v`, each voltage held until the next row.
    pub fn csv(&self) -> String {
        let row = |command: &Command| format!("{},{}\n", command.time_s, command.voltage_v);
        std::iter::once("time_s,voltage_v\n".to_owned()).chain(self.commands.iter().map(row)).collect()
    }
}

/// A suspect of the diagnosis, and what the experiment is predicted to show of it.
#[derive(Clone, Debug, Serialize)]
pub struct Suspected {
    /// Cause code.
    pub cause: String,
    /// The set of causes in which it is judged.
    pub causes: Vec<String>,
    /// Logarithm of its odds by the diagnosis, in nats: `-nats_short`, or `ln(p / (1 - p))` of its probability.
    pub nats: f64,
    /// Predicted probability that the experiment rejects all sets without it if its set is true.
    pub probability: f64,
    /// The set without it that is hardest to reject.
    pub rival: Vec<String>,
}

/// A true set of causes compared with a rival.
#[derive(Clone, Debug, Serialize)]
pub struct Separation {
    /// The set that is taken to be true.
    pub truth: Vec<String>,
    /// The set that is compared with it.
    pub rival: Vec<String>,
    /// Expected log-likelihood ratio in favour of the truth, in nats: the least over draws of its parameters.
    pub nats: f64,
    /// Predicted probability that the experiment rejects the rival.
    pub probability: f64,
}

/// A part of the schedule: the way to a level and the hold there.
#[derive(Clone, Debug, Serialize)]
pub struct Part {
    /// Start, in s.
    pub from_s: f64,
    /// End, in s.
    pub to_s: f64,
    /// Voltage at its end, in V.
    pub voltage_v: f64,
    /// True if the voltage goes there gradually.
    pub ramp: bool,
    /// Sets of causes, as indices into `decides`, of the pair that it separates most, or `None` if it separates nothing.
    pub separates: Option<[usize; 2]>,
    /// Part of that pair's separation that is due to it, 0 to 1.
    pub contribution: f64,
}

/// The 95 % interval of a parameter before and after an experiment.
#[derive(Clone, Debug, Serialize)]
pub struct Sharper {
    /// Cause code.
    pub cause: String,
    /// Name of the parameter.
    pub parameter: String,
    /// Value of the parameter, in `unit`.
    pub value: f64,
    /// Half of the interval of the diagnosis, in `unit`; `None` if the record does not determine it.
    pub now: Option<f64>,
    /// Half of the predicted interval of the experiment alone, in `unit`.
    pub planned: f64,
    /// Unit, "" for a dimensionless number.
    pub unit: String,
}

/// A commanded voltage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Command {
    /// Time, in s.
    pub time_s: f64,
    /// Voltage from then on, in V.
    pub voltage_v: f64,
}

/// The readings that a set of causes predicts.
#[derive(Clone, Debug)]
pub struct Response {
    /// The set.
    pub causes: Vec<String>,
    /// Times, in s.
    pub time_s: Vec<f64>,
    /// Readings, in their unit.
    pub reading: Vec<f64>,
}
