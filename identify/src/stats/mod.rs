//! Statistics without knowledge of the record: numbers come in, numbers go out.
//!
//! - *Robust scale*: a standard deviation estimated from the median absolute value, which outliers hardly change.
//! - *Root mean square* (RMS): the scale that every value changes.
//! - *Second difference*: `(x(n-1) - 2 x(n) + x(n+1)) / sqrt(6)`; it removes a slow signal and keeps the variance of
//!   independent noise.
//! - [`thresholds`]: the number that each decision of the diagnosis is compared with.
//! - *Periodogram*: the squared magnitude of the discrete Fourier transform.

#[cfg(test)]
pub(crate) mod coloured;
pub mod median;
pub mod periodogram;
pub(crate) mod rank;
pub mod scale;
pub(crate) mod segments;
pub(crate) mod shifted_run;
pub mod sums;
pub mod thresholds;
