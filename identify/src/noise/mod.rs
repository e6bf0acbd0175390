//! The noise of the readings: a residual comes in, its law and the likelihood of readings under that law go out.
//!
//! - *Residual*: reading minus prediction, in V, one value for each row.
//! - *Innovation*: the part of a residual that earlier residuals do not predict, in V.
//! - *Autocorrelated noise*: noise whose earlier values predict the next one (autoregressive, or fractionally integrated).
//! - *Censored reading*: one that stopped at a bound of the sensor; the true value is known to lie beyond it.
//!
//! | file | content |
//! | --- | --- |
//! | `term` | log-probability and weight of one reading |
//! | [`autocorrelation`] | the filter that turns autocorrelated noise into independent innovations |
//! | `law` | autocorrelation, scale and tail together, and the likelihood of a record |
//! | `tail` | fit of scale and tail to innovations |
//! | `rounding` | fit of the scale to rounded readings |
//! | `estimate` | all of these fitted to a residual |
//!
//! Without autocorrelation in the model, coloured noise would be reported as structure; without a heavy tail, a few
//! outliers would decide the fit.

pub mod autocorrelation;
mod band_spectrum;
mod estimate;
mod law;
mod rounding;
mod tail;
mod term;

pub use law::Noise;
pub use term::Term;
