//! What a record would have shown, where nothing is wrong.
//!
//! ```text
//! margin = (sqrt(2 N) + 1.64) / sqrt(J' W J)
//! ```
//!
//! An error of the gain that large, or of the time constant's logarithm, is likelier than no error by the `N` nats that its
//! cause and a rival's odds ask for. It shows in about nine of ten records like this one, in noise with a long memory, which
//! may hide it, in two of three. "Nothing is wrong" is worth no more than that.

use crate::adequacy::informative::{gain_and_time_constant, of_both};
use crate::answer::Margins;
use crate::fit::engine::{Engine, Fit};
use crate::fit::interval::information;
use crate::search::Judge;
use crate::verdict::alternatives::RIVAL;

/// 95 % of the standard normal.
const Z: f64 = 1.64;
/// An error of half the gain, or of a factor of 2 in the time constant, that need not show: the record can tell nothing.
const WIDEST: Margins = Margins { gain: 0.5, time_constant: 1.0 };

/// The smallest errors of gain and time constant that would show in a record on which nothing was found, as parts of the
/// simulation's; `caution` multiplies the price of a cause.
pub(crate) fn margins(engine: &mut Engine, nothing: &Fit, caution: f64) -> Margins {
    let model = of_both(engine.base().relaxation.tau_s);
    let known = information(engine, &Fit { model, ..nothing.clone() });
    let nats = gain_and_time_constant().map(|block| RIVAL + caution * Judge::price(engine, &block));
    let margin = |of: usize| ((2.0 * nats[of]).sqrt() + Z) / known[(of, of)].sqrt();
    Margins { gain: margin(0), time_constant: margin(1).exp_m1() }
}

/// True if the margins are narrow enough for "nothing is wrong" to be a statement about the spring.
pub(crate) fn informative(margins: &Margins) -> bool {
    margins.gain < WIDEST.gain && margins.time_constant < WIDEST.time_constant
}
