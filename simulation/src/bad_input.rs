//! The error that is the caller's to mend: a wrong file, setting or schedule. Exit code 2.

use std::fmt;
use std::ops::RangeInclusive;

use anyhow::Result;

/// Characters of a text that a message shows.
const MOST_SHOWN: usize = 40;

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
pub fn check(field: &str, value: f64, allowed: RangeInclusive<f64>, unit: &str) -> Result<f64> {
    if allowed.contains(&value) {
        return Ok(value);
    }
    let (lowest, highest) = allowed.into_inner();
    let expected = format!("{lowest} to {highest} {unit}");
    bad_input!("{field} = {} is not allowed: expected {}", number(value), expected.trim_end())
}

/// A number as a message shows it: not with hundreds of digits.
pub fn number(value: f64) -> String {
    let size = value.abs();
    let usual = size == 0.0 || (1e-9..1e15).contains(&size) || !value.is_finite();
    if usual { format!("{value}") } else { format!("{value:e}") }
}

/// A text as a message shows it: not whole pages of it.
pub fn excerpt(text: &str) -> String {
    match text.char_indices().nth(MOST_SHOWN) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_shown_shortly() {
        for (value, shown) in [
            (-1.0, "-1"),
            (-0.001, "-0.001"),
            (1e9, "1000000000"),
            (1e300, "1e300"),
            (-1e-300, "-1e-300"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            let error = check("x", value, 0.0..=1.0, "V").unwrap_err().to_string();
            assert_eq!(error, format!("x = {shown} is not allowed: expected 0 to 1 V"));
        }
        let whole = "\u{b5}".repeat(40);
        assert_eq!((excerpt(&whole), excerpt(&(whole.clone() + "V"))), (whole.clone(), whole + "..."));
    }
}
