//! What a diagnosis says, in the form that scripts read.

use serde::{Serialize, Serializer};

/// Version of the form.
pub const SCHEMA: u32 = 1;

/// The whole answer.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of this form.
    pub schema: u32,
    /// Number of readings.
    pub rows: usize,
    /// What to make of the record.
    pub verdict: Verdict,
    /// The simulation as it was.
    pub baseline: Quality,
    /// What it gets wrong, the largest error first.
    pub findings: Vec<Finding>,
    /// Parts of the plant file that are not in this spring: the extended simulation is without them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub take_out: Vec<&'static str>,
    /// Errors that would have shown, where nothing is wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub would_show: Option<Margins>,
    /// Other sets of causes that the data cannot reject.
    pub alternatives: Vec<Vec<&'static str>>,
    /// The experiment that would decide, or show more.
    pub next_experiment: Option<String>,
    /// The simulation with the named causes in it.
    pub extended: Extended,
    /// What no cause explains, where there is something.
    pub leftover: Option<String>,
    /// The noise that is left.
    pub noise: NoiseReport,
    /// Tests of what the extended simulation leaves.
    pub residual: ResidualReport,
}

/// What to make of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Nothing is wrong beyond noise.
    Consistent,
    /// The findings explain what is wrong.
    Explained,
    /// Rival sets of causes explain it as well.
    Ambiguous,
    /// Structure is left that no known cause explains.
    Unexplained,
    /// The record cannot tell.
    Insufficient,
}

/// How well a simulation fits.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quality {
    /// Root of the mean square of the free-run error, in V.
    pub rmse: f64,
    /// `100 (1 - |error| / |reading - mean|)`
    pub fit_percent: f64,
    /// The same error on stretches that no fit has seen, in V.
    pub held_out_rmse: f64,
    /// Error when each reading is foretold from the ones before it, in V.
    pub one_step_rmse: f64,
}

/// The extended simulation.
#[derive(Clone, Debug, Serialize)]
pub struct Extended {
    /// How well it fits.
    #[serde(flatten)]
    pub quality: Quality,
    /// `1 - extended / baseline` held-out error.
    pub gain: f64,
    /// The plant file that was written.
    pub model: Option<String>,
    /// Largest difference between the fixed-point tick and the fit, over the record, in V.
    pub fixed_point_error_v: Option<f64>,
    /// Why the tick does not run that plant file, where it does not.
    pub tick_refuses: Option<String>,
}

/// A named cause.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// Its name.
    pub cause: &'static str,
    /// How sure it is that this cause is there, beside the best explanation without it.
    pub probability: f64,
    /// Its parameters, in the order of its page.
    #[serde(serialize_with = "by_name")]
    pub parameters: Vec<(String, Parameter)>,
    /// Error of the best fit without it, in V.
    pub rmse_before: f64,
    /// Error with it, in V.
    pub rmse_after: f64,
    /// Why it is believed, in one sentence.
    pub evidence: String,
}

fn by_name<S: Serializer>(parameters: &[(String, Parameter)], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(parameters.iter().map(|(name, parameter)| (name, parameter)))
}

/// A parameter with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Likeliest value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// SI unit, "" for a ratio.
    pub unit: &'static str,
}

/// The noise of the readings.
#[derive(Clone, Debug, Serialize)]
pub struct NoiseReport {
    /// Scale of what cannot be foretold, in V.
    pub sigma: f64,
    /// Degrees of freedom of its tail; null for a normal one.
    pub tail: Option<f64>,
    /// How many rows it remembers.
    pub memory_rows: usize,
}

/// Tests of a residual.
#[derive(Clone, Debug, Serialize)]
pub struct ResidualReport {
    /// Autocorrelation of the whitened residual at lags 1 to 20.
    pub autocorrelation: Vec<f64>,
    /// Its correlation with the voltage's changes, 0 to 20 rows before.
    pub input_correlation: Vec<f64>,
    /// 95 % of chance values lie within this.
    pub band: f64,
}

/// Errors from which on they show, as parts of what is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Of the gain.
    pub gain: f64,
    /// Of the time constant, when it is too long.
    pub time_constant: f64,
}
