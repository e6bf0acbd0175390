//! Columns in memory as the text of a data file.
//!
//! The columns go through the reader of files, so that names, units, time stamps, missing readings and errors are those of a file.
//! Numbers are written with all their digits.

use std::fmt::Write;

use anyhow::Result;

use crate::bad_input;
use crate::csv_table::text::MOST_ROWS;

/// A column in memory.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Numbers; NaN is a missing reading.
    Numbers(Vec<f64>),
    /// Durations in s; NaN is a missing one.
    Durations(Vec<f64>),
    /// Texts, such as time stamps, or whole numbers with more digits than a double.
    Texts(Vec<String>),
    /// A column whose cells nobody reads, of any length.
    Unread,
}

impl Column {
    /// Number of rows, `None` if nobody reads them.
    fn rows(&self) -> Option<usize> {
        match self {
            Self::Numbers(numbers) | Self::Durations(numbers) => Some(numbers.len()),
            Self::Texts(texts) => Some(texts.len()),
            Self::Unread => None,
        }
    }

    fn write(&self, row: usize, text: &mut String) {
        match self {
            // Shortest digits that are read as the same number.
            Self::Numbers(numbers) | Self::Durations(numbers) => {
                write!(text, "{:?}", numbers[row]).expect("a String takes all")
            }
            Self::Texts(texts) => quote(&texts[row], text),
            Self::Unread => (),
        }
    }
}

/// Appends a cell in quotes.
fn quote(cell: &str, text: &mut String) {
    text.push('"');
    text.push_str(&cell.replace('"', "\"\"").replace(['\n', '\r'], " "));
    text.push('"');
}

/// The header of a table with these columns, as a line.
pub(super) fn header<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut text = String::new();
    for (index, name) in names.into_iter().enumerate() {
        if index > 0 {
            text.push(',');
        }
        quote(name, &mut text);
    }
    text.push('\n');
    text
}

/// The text of the data file with these columns, separated by commas; `name` is what messages call it.
///
/// # Errors
/// [`crate::BadInput`] for columns of different lengths and for more than a million rows.
pub(super) fn text(name: &str, columns: &[(String, Column)]) -> Result<String> {
    let lengths = columns.iter().filter_map(|(column, cells)| Some((column, cells.rows()?)));
    let (first, rows) = lengths.clone().next().map_or((None, 0), |(column, rows)| (Some(column), rows));
    for (column, found) in lengths {
        if let Some(first) = first
            && found != rows
        {
            bad_input!("{name}, column {column}: {found} rows; expected {rows} as in {first}");
        }
    }
    if rows > MOST_ROWS {
        return Err(too_many_rows(name).into());
    }
    let mut text = header(columns.iter().map(|(column, _)| column.as_str()));
    for row in 0..rows {
        for (index, (_, column)) in columns.iter().enumerate() {
            if index > 0 {
                text.push(',');
            }
            column.write(row, &mut text);
        }
        text.push('\n');
    }
    Ok(text)
}

/// The error for more rows than a record may have.
pub fn too_many_rows(name: &str) -> crate::BadInput {
    crate::BadInput(format!(
        "{name}: more than {MOST_ROWS} rows; expected at most that: keep every tenth row, or a part of the record"
    ))
}
