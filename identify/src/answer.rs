//! The data types of a report, as they are serialised to JSON. Names of fields and variants are part of the interface.

use serde::{Serialize, Serializer};

use crate::dimension::Dimension;
use crate::hypotheses::{Experiment, Rival, are_same};
use crate::stats::thresholds::probability::RIVAL_ODDS;

/// Version of the JSON format.
pub const SCHEMA: u32 = 1;

/// The report of a diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of the JSON format, [`SCHEMA`].
    pub schema: u32,
    /// Number of rows with a reading.
    pub rows: usize,
    /// False if the search was stopped by time or by the user; the report is then the best answer so far.
    pub complete: bool,
    /// How far the search got.
    pub search: SearchReport,
    /// The conclusion.
    pub verdict: Verdict,
    /// The simulation as it is given.
    pub nominal: Nominal,
    /// Errors of the simulation as it is given.
    pub baseline: Quality,
    /// Named causes, the one that explains the largest mean square error first.
    pub findings: Vec<Finding>,
    /// Causes that come closest to a finding but are none, the closest first; empty if the verdict is `explained`.
    pub suspects: Vec<Suspect>,
    /// Parts of the plant file that the record does not support; the extended simulation lacks them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub take_out: Vec<&'static str>,
    /// Smallest errors that would have been found; `None` if something was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub would_show: Option<Margins>,
    /// Other sets of causes that the record cannot reject, or that are left if a law that no cause describes is in place of a finding
    /// ([`Report::rejects`]).
    pub alternatives: Vec<Vec<&'static str>>,
    /// The experiment that would decide between the alternatives or show more, in one sentence.
    pub next_experiment: Option<String>,
    /// The simulation extended by the named causes.
    pub extended: Extended,
    /// The best linear model of order 1 to 4 on the same held-out segments; `None` if the voltage or the reading never changes, or
    /// under the report's stair.
    pub linear: Option<LinearError>,
    /// The equation that predicts held-out segments best where no set of causes explains the record, in ASCII mathematics; `None` if
    /// the record is explained, or no equation predicts better than the extended simulation and every linear model. A hypothesis,
    /// no finding.
    pub equation: Option<String>,
    /// What is known of the equation.
    pub equation_details: Option<Equation>,
    /// Structure in the residual that no cause explains, in one sentence.
    pub leftover: Option<String>,
    /// Parameters of the noise of the extended simulation.
    pub noise: NoiseReport,
    /// Correlations of the residual of the extended simulation.
    pub residual: ResidualReport,
    /// What each of several records shows beyond the causes that they share; empty for a single record.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub records: Vec<RecordReport>,
    /// The best sets of causes with their fits, the best first: what `vsj plan` decides between.
    pub rivals: Vec<Rival>,
    /// The experiment that they were fitted to; `None` until the diagnosis is finished.
    pub experiment: Option<Experiment>,
}

impl Report {
    /// Returns true if the readings themselves reject a set of causes, which is then an alternative only because a law that no cause
    /// describes may be in place of a finding that it lacks; false for a set that was not fitted.
    pub fn rejects(&self, set: &[&str]) -> bool {
        let fitted = self.rivals.iter().find(|rival| are_same(set, &rival.causes));
        fitted.is_some_and(|rival| rival.nats < -RIVAL_ODDS)
    }
}

/// What one of several records shows beyond the causes that they share.
#[derive(Clone, Debug, Serialize)]
pub struct RecordReport {
    /// Name of the record.
    pub name: String,
    /// Number of rows with a reading.
    pub rows: usize,
    /// Zero offset of the record, in the reading's unit.
    pub offset: f64,
    /// Scale of the innovations of its noise, in the reading's unit.
    pub sigma: f64,
    /// Root mean square error with the shared causes and its own findings, in the reading's unit.
    pub rmse: f64,
    /// The conclusion on this record, against the spring with the shared causes.
    pub verdict: Verdict,
    /// Causes that are in this record and not in all: faults of this record.
    pub findings: Vec<Finding>,
    /// Structure in the residual of this record that no cause explains, in one sentence.
    pub leftover: Option<String>,
}

/// Errors of the best linear model of one order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LinearError {
    /// Number of poles.
    pub order: usize,
    /// Root mean square error of the fit to all rows in free run, in the reading's unit.
    pub rmse: f64,
    /// Held-out root mean square error, in the reading's unit.
    pub held_out_rmse: f64,
    /// Root mean square error on the last 40 % of each record by a fit to its first 60 %, in the reading's unit.
    pub last_40_percent_rmse: f64,
}

/// An equation with its parameters and errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Equation {
    /// The equation in ASCII mathematics, with the names of its parameters.
    #[serde(skip)]
    pub text: String,
    /// Codes of what it has beyond a feedthrough and one lag, each once: `series-lag`, `play`, ...
    pub blocks: Vec<&'static str>,
    /// What each function and symbol in it is.
    pub definitions: Vec<String>,
    /// Parameters of the equation with their names.
    #[serde(serialize_with = "by_name")]
    pub parameters: Vec<(String, Parameter)>,
    /// Root mean square error in free run, in the reading's unit.
    pub rmse: f64,
    /// Root mean square errors on the same held-out segments, in the reading's unit.
    pub held_out: HeldOutErrors,
    /// By how much its log-likelihood on these segments exceeds that of the extended simulation, in nats, under the law of its own
    /// noise.
    pub nats_over_extended: f64,
    /// By how much its log-likelihood on these segments exceeds that of the best linear model, in nats.
    pub nats_over_linear: f64,
    /// The equation as a plant file, if the tick simulates all of it.
    pub plant: Option<String>,
    /// Why there is no plant file.
    pub no_plant: Option<String>,
}

/// Root mean square errors of four models on the same held-out segments, in the reading's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HeldOutErrors {
    /// The simulation as it is given.
    pub nominal: f64,
    /// The simulation extended by the named causes.
    pub extended: f64,
    /// The best linear model.
    pub linear: f64,
    /// The equation.
    pub equation: f64,
}

/// The conclusion on a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The simulation differs from the readings by noise only.
    Consistent,
    /// The findings explain all errors beyond noise.
    Explained,
    /// Another set of causes explains the errors equally well.
    Ambiguous,
    /// The residual holds structure that no known cause explains, or a linear model predicts better, or a cause does not extrapolate.
    Unexplained,
    /// The record does not identify gain and time constant.
    Insufficient,
}

/// The nominal spring: the simulation that a record is compared with.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Nominal {
    /// `paper`, or the plant file's name.
    pub plant: String,
    /// Change of the reading per V of equivalent static voltage, in the reading's unit per V.
    pub gain: f64,
    /// Reading at 0 V, in the reading's unit.
    pub zero: f64,
    /// Instantaneous part of a step.
    pub share: f64,
    /// Time constants, in s.
    pub tau_s: Vec<f64>,
    /// Delay of the amplifier, in s.
    pub delay_s: f64,
    /// Frequencies of its oscillations, in Hz.
    pub freq_hz: Vec<f64>,
}

/// Errors of a simulation.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quality {
    /// Root mean square of the free-running error, in the reading's unit.
    pub rmse: f64,
    /// `100 (1 - |error| / |reading - mean|)` with Euclidean norms over all rows, in percent; 100 is a perfect fit.
    pub fit_percent: f64,
    /// Root mean square of the free-running error on held-out segments, in the reading's unit.
    pub held_out_rmse: f64,
    /// Root mean square of the error of predicting each reading from the ones before it, in the reading's unit.
    pub one_step_rmse: f64,
}

/// The simulation extended by the named causes.
#[derive(Clone, Debug, Serialize)]
pub struct Extended {
    /// Errors of the extended simulation.
    #[serde(flatten)]
    pub quality: Quality,
    /// Held-out improvement, `1 - extended / baseline` of the root mean square errors; 0 without findings.
    pub gain: f64,
    /// Lowest and highest voltage at which the record shows the static law, in V, if a nonlinear one was found: the plant file is
    /// straight outside of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law_range_v: Option<[f64; 2]>,
    /// Path of the plant file that was written; `None` if none was.
    pub model: Option<String>,
    /// Largest absolute difference between the fixed-point tick and the fit over the record, in V; `None` if it was not run.
    pub fixed_point_error_v: Option<f64>,
    /// Why the tick rejects the plant file; `None` if it accepts it.
    pub tick_refuses: Option<String>,
}

/// A named cause.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// Code of the cause.
    pub cause: &'static str,
    /// Probability of the cause, 0 to 1: against the best explanation without it, and against a law that no cause describes.
    pub probability: f64,
    /// Parameters of the cause with their names, in the order of its page in the manual.
    #[serde(serialize_with = "by_name")]
    pub parameters: Vec<(String, Parameter)>,
    /// Root mean square error of the best fit without the cause, in the reading's unit; outliers are left out, but for their own finding.
    pub rmse_before: f64,
    /// Root mean square error with the cause, in the reading's unit, of the same readings; of their own finding without outliers.
    pub rmse_after: f64,
    /// The evidence, in one sentence.
    pub evidence: String,
    /// True if exact equality of readings proves the cause, whatever the law of the spring.
    #[serde(skip)]
    pub proved: bool,
}

impl Finding {
    /// True if the cause is at least as likely true as untrue.
    pub fn is_likely(&self) -> bool {
        self.probability >= 0.5
    }
}

/// A cause that comes close to a finding but is none.
#[derive(Clone, Debug, Serialize)]
pub struct Suspect {
    /// Code of the cause.
    pub cause: &'static str,
    /// The other causes of the set in which it comes closest; empty if it is alone.
    pub with: Vec<&'static str>,
    /// Parameters of the cause with their names, in the order of its page in the manual.
    #[serde(serialize_with = "by_name")]
    pub parameters: Vec<(String, Parameter)>,
    /// Root mean square error of the set without the cause, as `judge` measures it, in the reading's unit.
    pub rmse_before: f64,
    /// Root mean square error of the set, as `judge` measures it, in the reading's unit.
    pub rmse_after: f64,
    /// What the set's score lacks to that of the best set, in nats, not negative: with more, the cause would be a finding.
    pub nats_short: f64,
    /// How both errors were measured.
    pub judge: Judge,
    /// Probability of the cause, below 0.5, if the extended simulation contains it; none otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probability: Option<f64>,
}

/// How the errors with and without a suspect are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Judge {
    /// Held-out segments, each predicted by a fit to the others.
    HeldOut,
    /// Single readings, each predicted by a fit to all others: for causes that act in a part of the record, about which the other
    /// segments cannot know.
    LeaveOneOut,
    /// All readings, those of the fit: for causes that the extended simulation contains.
    Fit,
}

fn by_name<S: Serializer>(parameters: &[(String, Parameter)], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(parameters.iter().map(|(name, parameter)| (name, parameter)))
}

/// A parameter with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Maximum-likelihood estimate, in `unit`.
    pub value: f64,
    /// Lower end of the 95 % interval, in `unit`.
    pub low: f64,
    /// Upper end of the 95 % interval, in `unit`.
    pub high: f64,
    /// Unit, "" for a dimensionless number.
    pub unit: String,
    /// True if the value is at a bound of its range, so that the spring may need a value beyond.
    #[serde(skip_serializing_if = "is_false")]
    pub at_bound: bool,
    /// Lowest and highest voltage of the record, in V, if the parameter is the value of a curve at a voltage outside of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extrapolated_from_v: Option<[f64; 2]>,
    /// Dimension, which decides the unit in which texts show the value.
    #[serde(skip)]
    pub dimension: Dimension,
}

/// Returns true for false; serde omits such a field.
fn is_false(value: &bool) -> bool {
    !value
}

/// Parameters of the noise of the readings.
#[derive(Clone, Debug, Serialize)]
pub struct NoiseReport {
    /// Scale of the innovations, in the reading's unit.
    pub sigma: f64,
    /// Degrees of freedom of Student's t distribution; `None` for normal noise.
    pub tail: Option<f64>,
    /// Order of the autoregression, in rows; 0 for independent noise.
    pub memory_rows: usize,
}

/// How far a search got.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct SearchReport {
    /// `quick`, `normal` or `thorough`.
    pub effort: &'static str,
    /// Work that was done, in pieces of the voltage through one lag.
    pub work: u64,
    /// Work that the effort allows.
    pub allowed: u64,
    /// False if the work was used up before the search had tried all that it would; a larger effort may find more.
    pub finished: bool,
}

/// Correlations of a whitened residual.
#[derive(Clone, Debug, Serialize)]
pub struct ResidualReport {
    /// Autocorrelation at lags of 1 to 20 rows.
    pub autocorrelation: Vec<f64>,
    /// Correlation with changes of the voltage 0 to 20 rows earlier.
    pub input_correlation: Vec<f64>,
    /// Absolute value that 95 % of the correlations of independent noise stay below.
    pub band: f64,
}

/// Smallest errors that a record would have shown, as fractions of the simulation's values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Error of the static gain.
    pub gain: f64,
    /// Error of the time constant, if the spring's is longer.
    pub time_constant: f64,
}
