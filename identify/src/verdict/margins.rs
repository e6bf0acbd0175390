//! Smallest errors of gain and time constant that a record without findings would have shown.
//!
//! ```text
//! margin = (sqrt(2 N) + 1.645) / sqrt(J' W J)        J, W: sensitivities and weights of the rows
//! ```
//!
//! An error of the gain, or of the time constant's logarithm, of this size gains the `N` nats that the price of its cause and
//! the odds against a rival require. It is found in about nine of ten records like this one, and in two of three where
//! strongly autocorrelated noise may hide it. The verdict that nothing is wrong holds up to these margins.

use crate::adequacy::{gain_and_time_constant, model_of_both};
use crate::answer::Margins;
use crate::fit::engine::{Engine, Fit};
use crate::fit::interval::information;
use crate::plant::base::Base;
use crate::search::Evaluator;
use crate::stats::thresholds::empirical::{WIDEST_GAIN_MARGIN, WIDEST_TIME_CONSTANT_MARGIN};
use crate::stats::thresholds::probability::{RIVAL_ODDS, Z_POWER};

/// Smallest errors of gain and time constant that would have been found in a record without findings, as fractions of the
/// simulation's values; prices are multiplied by `penalty_factor`.
pub(crate) fn margins(engine: &mut Engine, nothing: &Fit, penalty_factor: f64) -> Margins {
    let model = model_of_both(engine.base().relaxation.tau_s);
    let known = information(engine, &Fit { model, ..nothing.clone() });
    let nats = gain_and_time_constant().map(|block| RIVAL_ODDS + penalty_factor * Evaluator::price(engine, &block));
    let margin = |of: usize| ((2.0 * nats[of]).sqrt() + Z_POWER) / known[(of, of)].sqrt();
    Margins { gain: margin(0), time_constant: margin(1).exp_m1() }
}

/// True if both margins are narrow enough for the verdict that nothing is wrong.
pub(crate) fn informative(margins: &Margins, base: &Base) -> bool {
    // The time constant of a spring that is all instantaneous has no effect.
    let lags = base.relaxation.share != 1.0;
    margins.gain < WIDEST_GAIN_MARGIN.get() && (!lags || margins.time_constant < WIDEST_TIME_CONSTANT_MARGIN.get())
}
