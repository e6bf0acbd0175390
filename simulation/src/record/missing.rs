//! Cells that say that there is no reading.

use anyhow::Result;

use crate::bad_input::BadInput;
use crate::csv_table::Row;

/// Marks of a missing reading, in any case: of people, numerical libraries, spreadsheets, data bases and Python. A reading out of range
/// (`OVLD`, `inf`) and a failed formula (`#DIV/0!`) are no missing ones: they say something about the spring, or about the file.
const MARKS: [&str; 11] = ["", "-", "nan", "-nan", "na", "n/a", "#n/a", "#nv", "<na>", "null", "none"];

/// True for a cell that says that there is no reading.
pub(super) fn is_missing(text: &str) -> bool {
    MARKS.iter().any(|mark| text.eq_ignore_ascii_case(mark))
}

/// The reading in a cell, a finite number of at most `most` in magnitude; `None` for a missing one.
///
/// # Errors
/// [`BadInput`] with file, line and column, and with the usual marks of a missing reading where the cell has no number.
pub(super) fn reading(row: &Row<'_>, column: usize, most: f64) -> Result<Option<f64>> {
    let text = row.text(column);
    if is_missing(text) {
        return Ok(None);
    }
    let is_digit = |letter: char| letter.is_ascii_digit() || ".,".contains(letter);
    let is_word = !text.trim_start_matches(['+', '-']).starts_with(is_digit);
    row.number_within(column, most).map(Some).map_err(|error| {
        let marks = "a missing reading is an empty cell, `-`, NaN, NA, N/A, #N/A, null or None";
        if is_word { BadInput(format!("{error}; {marks}")).into() } else { error }
    })
}
