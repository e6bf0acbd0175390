//! The data types of an identification, as they are serialised to JSON. Names of fields are part of the interface.

use serde::Serialize;

use crate::answer::LinearError;

/// A quantity with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// Estimate, in `unit`.
    pub value: f64,
    /// Lower end of the interval, in `unit`.
    pub low: f64,
    /// Upper end of the interval, in `unit`.
    pub high: f64,
    /// Unit, "" for a dimensionless number.
    pub unit: String,
}

/// A time constant with its part of the static gain.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimeConstant {
    /// The time constant, in s.
    #[serde(flatten)]
    pub tau: Quantity,
    /// Part of the static gain that relaxes with the time constant; parts of opposite sign are an overshoot.
    pub weight: Quantity,
}

/// A complex pair of poles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Oscillation {
    /// Undamped frequency, in Hz.
    pub freq_hz: Quantity,
    /// Damping ratio, 0 to 1.
    pub zeta: Quantity,
    /// Part of the static gain that the pair has.
    pub weight: Quantity,
    /// Weight of its rate of change, divided by the angular frequency, relative to the static gain.
    pub rate_weight: Quantity,
}

/// The linear spring that a record shows.
#[derive(Clone, Debug, Serialize)]
pub struct Nominal {
    /// Static change of the reading with the voltage, in the reading's unit per V.
    pub gain: Quantity,
    /// Reading at rest at 0 V, of the first record.
    pub zero: Quantity,
    /// Part of the static gain that is instantaneous.
    pub share: Quantity,
    /// Delay, in s.
    pub delay_s: Quantity,
    /// Time constants, the largest part of the static gain first.
    pub tau_s: Vec<TimeConstant>,
}

/// What a record's first reading tells.
#[derive(Clone, Debug, Serialize)]
pub struct Start {
    /// Name of the record.
    pub record: String,
    /// Zero of this record.
    pub zero: Quantity,
    /// The model's first reading minus the one that the first voltage settles at.
    pub offset: Quantity,
}

/// The errors that the model leaves.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Noise {
    /// Standard deviation, in the reading's unit.
    pub sigma: f64,
    /// Correlation of neighbouring errors.
    pub autocorrelation: f64,
    /// Scale of the errors from row to row, in the reading's unit: the standard deviation if they were independent.
    pub scatter: f64,
}

/// A reading that is far from those around it and from every model, so that it was left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FarReading {
    /// Name of the record.
    pub record: String,
    /// Time in the record, in s.
    pub time_s: f64,
    /// The reading, in its unit.
    pub reading: f64,
}

/// Readings that stopped at a bound of the sensor, so that they were left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AtBound {
    /// Name of the record.
    pub record: String,
    /// The bound, in the reading's unit.
    pub limit: f64,
    /// Number of readings at it.
    pub readings: usize,
}

/// A shift of the sensor's zero, that was fitted together with the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ZeroShift {
    /// Name of the record.
    pub record: String,
    /// Time in the record from which on the readings are shifted, in s.
    pub from_s: f64,
    /// The shift of the readings from there on, in their unit.
    pub by: f64,
}

/// What of the voltage the spring responds to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum InputLaw {
    /// The reading follows the voltage.
    Linear,
    /// The reading follows the magnitude of the voltage.
    Even,
    /// The reading follows the square of the voltage, divided by the voltage's largest magnitude: the gain is that at this voltage.
    Square,
}

/// The answer of `vsj identify`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of the JSON format.
    pub schema: u32,
    /// Number of readings of all records, without those that were left out.
    pub rows: usize,
    /// Number of poles of the nominal model.
    pub order: usize,
    /// Number of further poles that the readings show and the voltage does not drive: a drift or a hum, no part of the spring.
    pub undriven_order: usize,
    /// The model.
    pub nominal: Nominal,
    /// Complex pairs of poles.
    pub oscillation: Vec<Oscillation>,
    /// What of the voltage the spring responds to.
    pub input_law: InputLaw,
    /// Root mean square of the free-running error, in the reading's unit.
    pub rmse: f64,
    /// Root mean square of the free-running error on held-out segments, with several records on held-out records, in the reading's unit.
    pub held_out_rmse: f64,
    /// Root mean square error on the last 40 % of each record, by a fit of this structure to the first 60 %, in the reading's unit.
    pub last_40_percent_rmse: f64,
    /// Root mean square error on held-out segments of gain and zero alone, in the reading's unit.
    pub static_held_out_rmse: f64,
    /// The best linear models of order 1 to 4.
    pub linear: Vec<LinearError>,
    /// Zero and start of each record.
    pub start: Vec<Start>,
    /// The errors that the model leaves.
    pub noise: Noise,
    /// The readings that were left out because they are far from all others.
    pub left_out: Vec<FarReading>,
    /// The readings that were left out because they stopped at a bound.
    pub at_bound: Vec<AtBound>,
    /// The shifts of the sensor's zero that were fitted together with the model.
    pub zero_shifts: Vec<ZeroShift>,
    /// What the records cannot tell, one sentence each.
    pub remarks: Vec<String>,
    /// Name of the reading's unit.
    pub unit: String,
    /// Path of the plant file that was written; `None` if none was.
    pub model: Option<String>,
    /// Command line that computes how fast a controller can be with what is known of this spring; `None` if no files were written or
    /// `vsj bound` does not take the spring.
    pub bound_command: Option<String>,
}
