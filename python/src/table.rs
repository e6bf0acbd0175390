//! Columns in memory as the text of a data file.
//!
//! They go through the reader of files, so that names, units, time stamps, missing readings and errors are those of the command.
//! Numbers are written with all their digits.

use std::fmt::Write;

use anyhow::Result;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use simulation::bad_input;
use simulation::csv_table::text::Source;

/// Largest number of rows, as of a file.
const MOST_ROWS: usize = 1_000_000;

/// A column as Python hands it over.
#[derive(FromPyObject)]
pub(crate) enum Cells<'py> {
    /// Numbers; NaN is a missing reading.
    Numbers(PyReadonlyArray1<'py, f64>),
    /// Texts, such as time stamps.
    Texts(Vec<String>),
}

/// A column in memory of its own, which no other thread can change.
pub(crate) enum Column {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

impl Cells<'_> {
    pub(crate) fn copied(self) -> Column {
        match self {
            Self::Numbers(numbers) => Column::Numbers(numbers.as_array().to_vec()),
            Self::Texts(texts) => Column::Texts(texts),
        }
    }
}

impl Column {
    fn rows(&self) -> usize {
        match self {
            Self::Numbers(numbers) => numbers.len(),
            Self::Texts(texts) => texts.len(),
        }
    }

    fn write(&self, row: usize, text: &mut String) {
        match self {
            // Shortest digits that are read as the same number.
            Self::Numbers(numbers) => write!(text, "{:?}", numbers[row]).expect("a String takes all"),
            Self::Texts(texts) => quote(&texts[row], text),
        }
    }
}

/// Appends a cell in quotes.
fn quote(cell: &str, text: &mut String) {
    text.push('"');
    text.push_str(&cell.replace('"', "\"\"").replace(['\n', '\r'], " "));
    text.push('"');
}

/// The text of the data file with these columns; `name` is what messages call it.
///
/// # Errors
/// [`simulation::BadInput`] for columns of different lengths and for too many rows.
pub(crate) fn source(name: &str, columns: &[(String, Column)]) -> Result<Source> {
    let rows = columns.first().map_or(0, |(_, column)| column.rows());
    for (column, cells) in columns {
        if cells.rows() != rows {
            bad_input!("{name}, column {column}: {} rows; expected {rows} as in {}", cells.rows(), columns[0].0);
        }
    }
    if rows > MOST_ROWS {
        bad_input!(
            "{name}: more than {MOST_ROWS} rows; expected at most that: keep every tenth row, or a part of the record"
        );
    }
    let mut text = String::new();
    for (index, (column, _)) in columns.iter().enumerate() {
        if index > 0 {
            text.push(',');
        }
        quote(column, &mut text);
    }
    text.push('\n');
    for row in 0..rows {
        for (index, (_, column)) in columns.iter().enumerate() {
            if index > 0 {
                text.push(',');
            }
            column.write(row, &mut text);
        }
        text.push('\n');
    }
    Ok(Source::new(name, text))
}
