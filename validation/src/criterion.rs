//! Acceptance criteria: what is required of a result, and whether it is met.

use std::fmt::{self, Display};
use std::process::ExitCode;

use serde::Serialize;

/// An acceptance criterion: a quantity with its required range and its measured value.
#[derive(Clone, Debug, Serialize)]
pub struct Criterion {
    /// Quantity that is required to be in the range.
    pub what: String,
    /// Smallest accepted value.
    pub low: f64,
    /// Largest accepted value.
    pub high: f64,
    /// Measured value.
    pub found: f64,
}

impl Criterion {
    /// Criterion `found >= low`.
    pub fn at_least(what: impl Into<String>, low: f64, found: f64) -> Self {
        Self { what: what.into(), low, high: f64::INFINITY, found }
    }

    /// Criterion `found <= high`.
    pub fn at_most(what: impl Into<String>, high: f64, found: f64) -> Self {
        Self { what: what.into(), low: f64::NEG_INFINITY, high, found }
    }

    /// True if the measured value is in the range; NaN is not.
    pub fn is_met(&self) -> bool {
        (self.low..=self.high).contains(&self.found)
    }
}

impl Display for Criterion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, low, high, found } = self;
        let range = match (low.is_finite(), high.is_finite()) {
            (true, true) => format!("{low} to {high}"),
            (true, false) => format!("at least {low}"),
            _ => format!("at most {high}"),
        };
        write!(f, "{what}: {found:.3}, required {range}: {}", if self.is_met() { "met" } else { "NOT MET" })
    }
}

/// Exit code of a command: success if all criteria are met, failure if not or on an error, which is printed to stderr.
pub fn exit_code(met: anyhow::Result<bool>) -> ExitCode {
    match met {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_is_not_a_number_does_not_meet_its_criterion() {
        let criterion = Criterion::at_most("x", 1.1, f64::NAN);
        assert!(!criterion.is_met() && criterion.to_string().ends_with("required at most 1.1: NOT MET"));
    }
}
