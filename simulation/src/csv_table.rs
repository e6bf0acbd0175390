//! CSV tables with one header row, columns by name in any order, and comment lines that start with `#`.
//!
//! Errors are one line that names file, line, column and what was expected.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;
use std::str::FromStr;

use anyhow::Result;
use csv::StringRecord;

use crate::bad_input;
use crate::bad_input::{BadInput, excerpt};

/// Largest number of rows: a row of a record takes 40 bytes, its diagnosis 500.
const MOST_ROWS: usize = 1_000_000;
/// Largest size of a text, in bytes, since a single line may be very long.
const MOST_BYTES: u64 = 1 << 29;

/// Reads the text of a file.
///
/// # Errors
/// [`BadInput`] if the file cannot be read, is not UTF-8, is too large, or has more than a million rows.
pub fn read(path: &Path) -> Result<String> {
    let name = path.display();
    let unreadable = |error| BadInput(format!("{name}: cannot be read: {error}"));
    let mut file = BufReader::new(File::open(path).map_err(unreadable)?).take(MOST_BYTES);
    let mut text = String::new();
    // The file is read once, since it may be a pipe, and no further than the limit.
    for line in 1..=MOST_ROWS + 2 {
        match file.read_line(&mut text) {
            Ok(1..) => (),
            _ if file.limit() == 0 => bad_input!(
                "{name}: more than {} MiB; expected at most that: keep every tenth row, or a part of the record",
                MOST_BYTES >> 20
            ),
            Ok(0) => return Ok(text),
            Err(error) if error.kind() == ErrorKind::InvalidData => {
                bad_input!("{name}, line {line}: not UTF-8; expected a text in UTF-8")
            }
            Err(error) => return Err(unreadable(error).into()),
        }
    }
    bad_input!(
        "{name}: more than {MOST_ROWS} lines; expected at most that: keep every tenth row, or a part of the record"
    )
}

/// A table, read row by row.
pub struct Table<'a> {
    name: &'a str,
    header: StringRecord,
    reader: csv::Reader<&'a [u8]>,
    record: StringRecord,
    lines: Lines<'a>,
}

/// A row of a [`Table`].
pub struct Row<'t> {
    name: &'t str,
    header: &'t StringRecord,
    record: &'t StringRecord,
    /// Line of the file, from 1.
    pub line: usize,
}

impl<'a> Table<'a> {
    /// Reads the header; `name` is what messages call the table.
    pub fn new(name: &'a str, text: &'a str) -> Result<Self> {
        // Rows of another length are reported by [`Table::next_row`], which knows their line.
        let mut builder = csv::ReaderBuilder::new();
        builder.comment(Some(b'#')).trim(csv::Trim::All).flexible(true);
        let mut reader = builder.from_reader(text.as_bytes());
        let mut lines = Lines { text, byte: 0, line: 1 };
        let header = reader.headers().map_err(|error| unreadable(name, &mut lines, &error))?.clone();
        let twice =
            |(index, column): &(usize, &str)| !column.is_empty() && header.iter().take(*index).any(|c| c == *column);
        if let Some((_, column)) = header.iter().enumerate().find(twice) {
            let line = lines.at(header.position());
            let column = excerpt(column);
            bad_input!("{name}, line {line}: column `{column}` appears twice; expected every column once");
        }
        Ok(Self { name, header, reader, record: StringRecord::new(), lines })
    }

    /// Name of the table in messages.
    pub fn name(&self) -> &'a str {
        self.name
    }

    /// Names of the columns, in their order.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.header.iter()
    }

    /// Index of a column, `None` if the table does not have it.
    pub fn find(&self, column: &str) -> Option<usize> {
        self.columns().position(|name| name == column)
    }

    /// Index of a column that must exist; `expected` lists the columns for the error.
    pub fn require(&mut self, column: &str, expected: &str) -> Result<usize> {
        self.find(column).ok_or_else(|| self.lacks(column, expected).into())
    }

    /// The error for a missing column.
    pub fn lacks(&mut self, column: &str, expected: &str) -> BadInput {
        let name = self.name;
        if self.columns().all(str::is_empty) {
            return BadInput(format!("{name}: no header; expected one with {expected}"));
        }
        let line = self.lines.at(self.header.position());
        if self.columns().any(unclosed) {
            return BadInput(format!("{name}, line {line}: {UNCLOSED}; expected a header with {expected}"));
        }
        let found = excerpt(&self.columns().collect::<Vec<_>>().join(","));
        BadInput(format!(
            "{name}, line {line}: no column `{column}`; expected a header with {expected}, found `{found}`"
        ))
    }

    /// Reads the next row; `None` after the last.
    pub fn next_row(&mut self) -> Result<Option<Row<'_>>> {
        match self.reader.read_record(&mut self.record) {
            Ok(false) => Ok(None),
            Ok(true) => {
                let (name, line) = (self.name, self.lines.at(self.record.position()));
                let (found, expected) = (self.record.len(), self.header.len());
                if found != expected {
                    let why =
                        if self.record.iter().any(unclosed) { format!(" with {UNCLOSED}") } else { String::new() };
                    bad_input!("{name}, line {line}: {found} field(s){why}; expected {expected} as in the header");
                }
                Ok(Some(Row { name, header: &self.header, record: &self.record, line }))
            }
            Err(error) => Err(unreadable(self.name, &mut self.lines, &error).into()),
        }
    }
}

fn unreadable(name: &str, lines: &mut Lines<'_>, error: &csv::Error) -> BadInput {
    BadInput(format!("{name}, line {}: {error}; expected CSV", lines.at(error.position())))
}

/// Describes a cell that contains a line break.
const UNCLOSED: &str = "a line break, perhaps after an unclosed quote";

fn unclosed(cell: &str) -> bool {
    cell.contains(['\n', '\r'])
}

impl Row<'_> {
    /// The text of a cell.
    pub fn text(&self, column: usize) -> &str {
        &self.record[column]
    }

    /// A finite number.
    pub fn number(&self, column: usize) -> Result<f64> {
        self.value(column, "a finite number", |number: &f64| number.is_finite())
    }

    /// A finite number of at most `most` in magnitude.
    pub fn number_within(&self, column: usize, most: f64) -> Result<f64> {
        self.number(column)?;
        self.value(column, &format!("a number from -{most} to {most}"), |number: &f64| number.abs() <= most)
    }

    /// A finite number of at most `most` in magnitude, or `None` for a cell with a dash.
    pub fn number_or_dash(&self, column: usize, most: f64) -> Result<Option<f64>> {
        match self.text(column) {
            "-" => Ok(None),
            "" => self.value(column, "a finite number; expected `-` for a missing reading", |_: &f64| false).map(Some),
            _ => self.number_within(column, most).map(Some),
        }
    }

    /// A whole number, 0 or more.
    pub fn whole(&self, column: usize) -> Result<usize> {
        self.value(column, "a whole number", |_| true)
    }

    fn value<T: FromStr>(&self, column: usize, what: &str, fits: impl Fn(&T) -> bool) -> Result<T> {
        let Some(value) = self.text(column).parse().ok().filter(fits) else {
            let (text, Self { name, line, .. }) = (self.text(column), self);
            let column = excerpt(&self.header[column]);
            if unclosed(text) {
                bad_input!("{name}, line {line}, column {column}: {UNCLOSED}; expected {what}");
            }
            bad_input!("{name}, line {line}, column {column}: `{}` is not {what}", excerpt(text))
        };
        Ok(value)
    }
}

/// Finds the line numbers of records, read in order.
struct Lines<'a> {
    text: &'a str,
    byte: usize,
    line: usize,
}

impl Lines<'_> {
    /// Line number of a record. Its position is that of the reader before it skipped comments and blank lines.
    fn at(&mut self, position: Option<&csv::Position>) -> usize {
        let start = position.map_or(0, |at| at.byte() as usize).clamp(self.byte, self.text.len());
        self.line += self.text[self.byte..start].matches('\n').count();
        self.byte = start;
        let skipped = self.text[start..].lines().take_while(|line| line.is_empty() || line.starts_with('#'));
        self.line + skipped.count()
    }
}
