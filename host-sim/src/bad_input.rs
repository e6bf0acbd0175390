//! The error that is the caller's to mend: a wrong file, setting or schedule. Exit code 2.

use std::fmt;
use std::ops::RangeInclusive;

use anyhow::Result;

/// One line that names what was given and what was expected.
#[derive(Debug)]
pub struct BadInput(pub String);

impl fmt::Display for BadInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for BadInput {}

/// Returns early with a [`BadInput`] made of a format string.
#[macro_export]
macro_rules! bad_input {
    ($($message:tt)*) => {
        return Err($crate::bad_input::BadInput(format!($($message)*)).into())
    };
}

/// Returns `value` if it is in `allowed`; NaN is in no range.
///
/// # Errors
/// [`BadInput`] that names the field, the value and what is expected.
pub(crate) fn check(field: &str, value: f64, allowed: RangeInclusive<f64>, unit: &str) -> Result<f64> {
    if allowed.contains(&value) {
        return Ok(value);
    }
    let (lowest, highest) = allowed.into_inner();
    let expected = format!("{lowest} to {highest} {unit}");
    // Not with hundreds of digits.
    let value = if value.abs() < 1e15 || !value.is_finite() { format!("{value}") } else { format!("{value:e}") };
    bad_input!("{field} = {value} is not allowed: expected {}", expected.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_shown_shortly() {
        for (value, shown) in
            [(-1.0, "-1"), (1e9, "1000000000"), (1e300, "1e300"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")]
        {
            let error = check("x", value, 0.0..=1.0, "V").unwrap_err().to_string();
            assert_eq!(error, format!("x = {shown} is not allowed: expected 0 to 1 V"));
        }
    }
}
