//! Cells and lines of tables on the terminal.

use std::fmt::Write;

/// Rounds to six decimals, so that trailing zeros are not printed.
pub(super) fn tidy(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

pub(super) fn optional(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}

pub(super) fn line(text: &mut String, line: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{}", line.trim_end());
}
