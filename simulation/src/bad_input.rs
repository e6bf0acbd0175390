//! The error for invalid input: a wrong file, setting or schedule. `vsj` then exits with code 2.

use std::fmt;
use std::ops::RangeInclusive;

use anyhow::Result;
use model::OutOfRange;

/// Largest number of characters of a quoted text that a message shows.
const MOST_SHOWN: usize = 40;

/// Invalid input, as one line that names what was given and what was expected.
#[derive(Debug)]
pub struct BadInput(pub String);

impl fmt::Display for BadInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for BadInput {}

impl From<OutOfRange> for BadInput {
    /// The message of a setting that the model rejects: field, value and allowed range.
    fn from(error: OutOfRange) -> Self {
        Self(error.to_string())
    }
}

/// Returns early with a [`BadInput`] made from a format string.
#[macro_export]
macro_rules! bad_input {
    ($($message:tt)*) => {
        return Err($crate::bad_input::BadInput(format!($($message)*)).into())
    };
}

/// Returns `value` if it lies in `allowed`; NaN lies in no range.
///
/// # Errors
/// [`BadInput`] with the field, the value and the allowed range.
pub fn check(field: &str, value: f64, allowed: RangeInclusive<f64>, unit: &str) -> Result<f64> {
    if allowed.contains(&value) {
        return Ok(value);
    }
    let (lowest, highest) = allowed.into_inner();
    let expected = format!("{lowest} to {highest} {unit}");
    bad_input!("{field} = {} is not allowed: expected {}", number(value), expected.trim_end())
}

/// Formats a number for a message, in exponential form if it would have very many digits.
pub fn number(value: f64) -> String {
    let size = value.abs();
    let usual = size == 0.0 || (1e-9..1e15).contains(&size) || !value.is_finite();
    if usual { format!("{value}") } else { format!("{value:e}") }
}

/// Shortens a text for a message.
pub fn excerpt(text: &str) -> String {
    match text.char_indices().nth(MOST_SHOWN) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// Escapes the control characters of a text that comes from a file: a message is one line, and does not command a terminal.
pub fn one_line(text: &str) -> String {
    let escaped = |letter: char| if letter.is_control() { letter.escape_default().to_string() } else { letter.into() };
    text.chars().map(escaped).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejected_values_are_shown_in_short_form() {
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
        assert_eq!(one_line("a\r\nb\u{1b}[2J \u{b5}"), "a\\r\\nb\\u{1b}[2J \u{b5}");
        let whole = "\u{b5}".repeat(40);
        assert_eq!((excerpt(&whole), excerpt(&(whole.clone() + "V"))), (whole.clone(), whole + "..."));
    }
}
