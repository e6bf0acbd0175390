//! Numbers as the command shows them.

use identify::dimension;
use pyo3::prelude::*;

/// A number with four significant digits.
#[pyfunction]
pub(crate) fn number(value: f64) -> String {
    dimension::significant(value, 4)
}

/// A value and its interval, which is empty where its ends are shown as one number.
#[pyfunction]
pub(crate) fn with_interval(value: f64, low: f64, high: f64) -> (String, String) {
    dimension::with_interval([value, low, high])
}
