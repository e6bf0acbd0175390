//! What a diagnosis leaves to decide, as data that a later program reads back: sets of causes with their fits, and the experiment
//! that they were fitted to.
//!
//! The diagnosis fills these types, and the next experiment is computed from them. Points of models, covariances and noise are in the
//! normalised coordinates of the search; voltages, times and parameters are in s and V.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A set of causes with its fit to the record: one of several explanations that an experiment may decide between.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rival {
    /// Cause codes in the order of the chain; empty for the simulation as it is given.
    pub causes: Vec<String>,
    /// Score less that of the best set, in nats: 0 for the best, negative for the others.
    pub nats: f64,
    /// Parameters of each cause by name, with their 95 % intervals.
    #[serde(default)]
    pub parameters: BTreeMap<String, BTreeMap<String, Interval>>,
    /// The blocks of the model, in the order of `causes`.
    pub blocks: Vec<FittedBlock>,
    /// Covariance of the fitted coordinates of all blocks; empty if the record does not determine it.
    pub covariance: Vec<Vec<f64>>,
}

/// Returns true if two sets of causes are the same, in any order.
pub(crate) fn are_same(one: &[impl AsRef<str>], other: &[impl AsRef<str>]) -> bool {
    let has = |cause: &str| one.iter().any(|own| own.as_ref() == cause);
    one.len() == other.len() && other.iter().all(|cause| has(cause.as_ref()))
}

/// A parameter with its 95 % interval; an end that the record does not determine is `None`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Maximum-likelihood estimate, in `unit`.
    pub value: Option<f64>,
    /// Lower end, in `unit`.
    pub low: Option<f64>,
    /// Upper end, in `unit`.
    pub high: Option<f64>,
    /// Unit, "" for a dimensionless number.
    pub unit: String,
}

/// One block of a fitted model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedBlock {
    /// Cause code.
    pub cause: String,
    /// Index of the form of the cause.
    pub form: usize,
    /// Values of its coordinates, normalised.
    pub point: Vec<f64>,
}

/// The experiment behind a diagnosis: what a prediction of the next experiment needs to know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    /// The simulation as it is given, without the parts that the record does not support: the text of a plant file.
    pub plant: String,
    /// Lowest commanded voltage of the record, in V.
    pub lowest_v: f64,
    /// Highest commanded voltage of the record, in V.
    pub highest_v: f64,
    /// Median time between two readings, in s.
    pub sample_s: f64,
    /// Time from the first to the last reading, in s.
    pub duration_s: f64,
    /// Name of the reading's unit.
    pub reading_unit: String,
    /// The coordinates of the models.
    pub coordinates: Coordinates,
    /// The noise of the best fit.
    pub noise: FittedNoise,
}

/// The normalised coordinates of a record, in which the search works.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coordinates {
    /// Length of a normalised second, in s.
    pub second_s: f64,
    /// Size of a normalised volt, in V.
    pub volt_v: f64,
    /// Reading at normalised reading 0.
    pub zero: f64,
    /// Change of the reading per normalised volt of reading.
    pub reading: f64,
    /// Change of the nominal's normalised reading per normalised volt of stiffness.
    pub output: f64,
    /// Instantaneous share that the search expects.
    pub share: f64,
    /// True if the nominal spring responds to the voltage's magnitude.
    pub even: bool,
    /// The first-order spring from which the search started; `None` if the nominal spring is not far from the record.
    pub start: Option<FirstSpring>,
    /// Largest magnitude of the record's voltage, in normalised V.
    pub full_scale_v: f64,
    /// Largest magnitude of the record's voltage and readings, in normalised V; 0 if it is not known.
    #[serde(default)]
    pub largest_v: f64,
    /// Voltage at which curves over the voltage begin, in normalised V.
    #[serde(default)]
    pub origin_v: f64,
    /// Median time between two readings, in normalised s.
    pub sample_s: f64,
    /// True if the readings are uniformly sampled.
    pub uniform: bool,
}

/// The spring of a first-order fit, normalised.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FirstSpring {
    /// Gain relative to the nominal gain.
    pub gain: f64,
    /// Time constant, in normalised s.
    pub tau_s: f64,
    /// Instantaneous part of a step.
    pub share: f64,
    /// Zero of the readings less the nominal zero, in normalised V.
    pub offset: f64,
}

/// The law of the noise of a fit, in normalised V.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedNoise {
    /// Scale of the innovations.
    pub sigma: f64,
    /// Degrees of freedom of Student's t distribution; `None` for normal noise.
    pub tail: Option<f64>,
    /// Coefficients of the autoregression, lag 1 first.
    pub ar: Vec<f64>,
    /// Order of the fractional difference, 0 for none.
    pub power: f64,
    /// Half of the quantisation step if that is coarse compared with the noise, else 0.
    pub half_step: f64,
    /// Root mean square of the structure that the best set of causes leaves unexplained.
    pub unexplained: f64,
    /// Highest reading of the sensor, if readings stopped there.
    pub upper: Option<f64>,
    /// Lowest reading of the sensor, if readings stopped there.
    pub lower: Option<f64>,
}
