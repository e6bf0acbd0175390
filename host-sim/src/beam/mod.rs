//! The leaf spring as a beam, clamped at one end: what was measured, what theory says, and the stack of its layers.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`regression`] | straight lines through readings, with intervals and a test for readings out of line |
//! | [`experiment`] | Table 1: spring constants, Young's modulus against voltage, the range within reach |
//! | [`cantilever`] | deflection under tip load and own weight, linear |
//! | [`elastica`] | the same, geometrically exact |
//! | [`droop`] | where the linear result stops being valid, and the exact one takes over |
//! | [`stack`] | the layers of the spring |
//! | [`layered`] | the stack by finite elements, with slip between its layers |
//! | [`slip`] | how much slip the measured stiffness says there is |
//! | [`report`] | what `vsj beam` says and draws |

pub mod cantilever;
pub mod droop;
pub mod elastica;
pub mod experiment;
pub mod layered;
pub mod regression;
pub mod report;
pub mod slip;
pub mod stack;

use std::ops::RangeInclusive;

use anyhow::Result;

use crate::bad_input;

/// Returns `value` if it is in `allowed`; NaN is in no range.
///
/// # Errors
/// [`crate::BadInput`] that names the field, the value and what is expected.
pub(crate) fn check(field: &str, value: f64, allowed: RangeInclusive<f64>, unit: &str) -> Result<f64> {
    if allowed.contains(&value) {
        return Ok(value);
    }
    let (lowest, highest) = allowed.into_inner();
    bad_input!("{field} = {value} is not allowed: expected {lowest} to {highest} {unit}")
}
