//! CSV tables with one header row, columns by name in any order, and comment lines that start with `#`.
//!
//! Columns may be separated by commas, semicolons, tabs, vertical bars or blanks; where it is not a comma, the decimal mark may be one.
//!
//! Errors are one line that names file, line, column and what was expected.

pub mod dialect;
mod header;
mod stream;
pub mod text;

use std::path::Path;

use anyhow::Result;
use csv::StringRecord;

use crate::bad_input;
use crate::bad_input::{BadInput, excerpt, number};
use dialect::{Dialect, Numbers, Separator};
use header::{are_names, is_left_out};
use stream::{Stream, unwrapped};
use text::Source;

/// Reads the text of a file.
///
/// # Errors
/// [`BadInput`] if the file cannot be read, is not UTF-8, is too large, or has more than a million rows.
pub fn read(path: &Path) -> Result<String> {
    Source::open(path)?.utf_8()
}

/// How messages number the rows of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Numbering {
    /// By their lines in the text file, from 1.
    #[default]
    Lines,
    /// By rows of data, from 1: the table comes from a file without lines, and its text is one line a row.
    Rows,
}

/// A table, read row by row from a stream.
pub struct Table<'a> {
    name: String,
    numbering: Numbering,
    header: StringRecord,
    header_line: usize,
    /// Line of a comment that has as many names as the table has columns.
    commented_header: Option<usize>,
    /// Line of a header with other text above it.
    below_titles: Option<usize>,
    separator: Separator,
    numbers: Numbers,
    reader: csv::Reader<Stream<'a>>,
    record: StringRecord,
    line: usize,
    /// True if the row in `record` is the next one as well.
    is_returned: bool,
}

/// A row of a [`Table`].
pub struct Row<'t> {
    name: &'t str,
    numbering: Numbering,
    header: &'t StringRecord,
    numbers: &'t Numbers,
    record: &'t StringRecord,
    /// Line of the file, or number of the row, from 1.
    pub line: usize,
}

impl<'a> Table<'a> {
    /// Reads the header; `name` is what messages call the table. Separator and decimal mark are found in the text.
    ///
    /// # Errors
    /// [`BadInput`] with the line of an invalid header.
    pub fn new(name: &str, text: &'a str) -> Result<Self> {
        Self::read(Source::read(name, text.as_bytes()), Dialect::default())
    }

    /// Reads the header of a table whose dialect may be known.
    ///
    /// # Errors
    /// [`BadInput`] with the line of an invalid header, and where the source cannot be read or exceeds its bounds. Reading a row
    /// has the latter errors, too.
    pub fn read(source: Source<'a>, dialect: Dialect) -> Result<Self> {
        let (name, numbering) = (source.name.clone(), source.numbering());
        let mut text = Stream::new(source);
        let named = text.skip_preamble()?;
        let (separator, below_titles) = match numbering {
            Numbering::Lines => text.skip_titles(dialect.separator.or(named))?,
            Numbering::Rows => (Separator::COMMA, None),
        };
        let commented = text.last_comment().map(|(line, names)| (line, names.to_owned()));
        // Rows of another length are reported by [`Table::next_row`], which knows their line.
        let mut builder = csv::ReaderBuilder::new();
        builder.delimiter(separator.0).comment(Some(b'#')).trim(csv::Trim::All).flexible(true);
        let mut reader = builder.from_reader(text);
        let mut header = reader.headers().map_err(unreadable)?.clone();
        let line = line_of(&header, &mut reader);
        let names = header.iter().enumerate().filter(|(_, column)| !column.is_empty());
        let last_name = names.map(|(index, _)| index).last().unwrap_or(0);
        keep_columns(&mut header, separator, |index| index <= last_name);
        let twice =
            |(index, column): &(usize, &str)| !column.is_empty() && header.iter().take(*index).any(|c| c == *column);
        let commented_header = commented
            .filter(|(_, names)| header.len() > 1 && are_names(names, separator, header.len()))
            .map(|(line, _)| line);
        // Numbers are no names: the error for a missing column says so.
        if !are_numbers(&header)
            && let Some((_, column)) = header.iter().enumerate().find(twice)
        {
            let column = excerpt(column);
            bad_input!(
                "{}: column `{column}` appears twice; expected every column once",
                numbering.header(&name, line)
            );
        }
        Ok(Self {
            name,
            numbering,
            header,
            header_line: line,
            commented_header,
            below_titles,
            separator,
            numbers: Numbers::new(dialect, separator),
            reader,
            record: StringRecord::new(),
            line,
            is_returned: false,
        })
    }

    /// Name of the table in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the user should know about the encoding of what was read so far, and about text above the header.
    pub fn remarks(&self) -> impl Iterator<Item = String> {
        let encoding = self.reader.get_ref().remark().map(str::to_owned);
        encoding.into_iter().chain(self.titles().map(|titles| format!("{titles}, skipped")))
    }

    /// Says which line is the header, where other text than comments is above it.
    pub(crate) fn titles(&self) -> Option<String> {
        let (name, line) = (&self.name, self.below_titles?);
        Some(format!("{name}: {} line(s) above the header in line {line}", line - 1))
    }

    /// Names of the columns, in their order.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.header.iter()
    }

    /// Name of the column with an index; empty if there is none.
    pub fn column(&self, index: usize) -> &str {
        self.header.get(index).unwrap_or_default()
    }

    /// True for a column of comments, which rows may lack.
    pub(crate) fn has_comments(&self, index: usize) -> bool {
        index + 1 == self.header.len() && is_left_out(self.column(index))
    }

    /// Index of a column, `None` if the table does not have it. Without a column of exactly this name, the only one that has
    /// it apart from case, blanks and quotes.
    pub fn find(&self, column: &str) -> Option<usize> {
        let alike = || {
            let mut alike = self.columns().enumerate().filter(|(_, name)| plain(name) == plain(column));
            alike.next().filter(|_| alike.next().is_none()).map(|(index, _)| index)
        };
        self.columns().position(|name| name == column).or_else(alike)
    }

    /// File and line of the header, for messages.
    pub fn header_place(&self) -> String {
        self.numbering.header(&self.name, self.header_line)
    }

    /// Index of a column that must exist; `expected` lists the columns for the error.
    pub fn require(&self, column: &str, expected: &str) -> Result<usize> {
        self.find(column).ok_or_else(|| self.lacks(column, expected).into())
    }

    /// The error for a missing column.
    pub fn lacks(&self, column: &str, expected: &str) -> BadInput {
        let name = &self.name;
        if self.columns().all(str::is_empty) {
            return BadInput(format!("{name}: no header; expected one with {expected}"));
        }
        let place = self.header_place();
        if self.columns().any(unclosed) {
            return BadInput(format!("{place}: {UNCLOSED}; expected a header with {expected}"));
        }
        if let Some(line) = self.commented_header.filter(|_| are_numbers(&self.header)) {
            return BadInput(format!(
                "{name}, line {line}: the names of the columns are a comment; expected a header: remove the mark in front of them"
            ));
        }
        if are_numbers(&self.header) {
            return BadInput(format!("{place}: numbers instead of names; expected a header with {expected}"));
        }
        let found = excerpt(&self.columns().collect::<Vec<_>>().join(","));
        BadInput(format!("{place}: no column `{column}`; expected a header with {expected}, found `{found}`"))
    }

    /// The error for a column that an option names for another quantity than the one that it already is.
    pub(crate) fn is_taken(&self, index: usize, quantity: &str, option: &str) -> BadInput {
        let column = excerpt(self.column(index)).replace(['\n', '\r'], " ");
        let place = self.header_place();
        BadInput(format!("{place}: column `{column}` is the {quantity}; expected another one for {option}"))
    }

    /// Reads the next row; `None` after the last.
    ///
    /// # Errors
    /// [`BadInput`] with the line of a row that has not as many fields as the header; empty ones at its end do not count, nor does a
    /// comment that is not there.
    pub fn next_row(&mut self) -> Result<Option<Row<'_>>> {
        if !std::mem::take(&mut self.is_returned) && !self.advance()? {
            return Ok(None);
        }
        let Self { name, numbering, header, numbers, record, line, .. } = self;
        let line = if *numbering == Numbering::Rows { *line - self.header_line } else { *line };
        Ok(Some(Row { name, numbering: *numbering, header, numbers, record, line }))
    }

    /// Makes the row that was read last the next one again.
    pub(crate) fn return_row(&mut self) {
        self.is_returned = true;
    }

    /// Reads the next row; `false` after the last. Lines without content are no rows: spreadsheets write some below a table.
    fn advance(&mut self) -> Result<bool> {
        let expected = self.header.len();
        while self.reader.read_record(&mut self.record).map_err(unreadable)? {
            self.line = line_of(&self.record, &mut self.reader);
            if self.numbering == Numbering::Lines && self.record.iter().all(str::is_empty) {
                continue;
            }
            if self.separator == Separator::BLANKS || self.record.len() > expected {
                let is_trailing = self.record.iter().skip(expected).all(str::is_empty);
                keep_columns(&mut self.record, self.separator, |index| index < expected || !is_trailing);
            }
            if self.record.len() + 1 == expected && self.has_comments(expected - 1) {
                self.record.push_field("");
            }
            let found = self.record.len();
            if found == expected {
                return Ok(true);
            }
            if found > 0 {
                let why = if self.record.iter().any(unclosed) { format!(" with {UNCLOSED}") } else { String::new() };
                let has_decimal_commas =
                    self.separator == Separator::COMMA && (expected + 1..=2 * expected).contains(&found);
                let hint =
                    if has_decimal_commas { " (decimal commas need another separator, `;` or a tab)" } else { "" };
                let (name, line) = (&self.name, self.line);
                bad_input!("{name}, line {line}: {found} field(s){why}; expected {expected} as in the header{hint}");
            }
        }
        self.numbers.check()?;
        Ok(false)
    }
}

impl Numbering {
    /// What a row's number is called.
    pub(crate) fn word(self) -> &'static str {
        ["line", "row"][self as usize]
    }

    /// File and line of a header; a file without lines has the names of its columns elsewhere.
    fn header(self, name: &str, line: usize) -> String {
        if self == Self::Lines { format!("{name}, line {line}") } else { name.to_owned() }
    }
}

/// Keeps the cells for whose index `keep` holds; of cells between blanks, those that are not empty.
fn keep_columns(record: &mut StringRecord, separator: Separator, keep: impl Fn(usize) -> bool) {
    let position = record.position().cloned();
    let cells = record.iter().filter(|cell| separator != Separator::BLANKS || !cell.is_empty());
    let mut kept: StringRecord = (0..).zip(cells).filter(|(index, _)| keep(*index)).map(|(_, cell)| cell).collect();
    kept.set_position(position);
    *record = kept;
}

/// True for a row of numbers where names were expected.
fn are_numbers(header: &StringRecord) -> bool {
    header.iter().all(|column| column.parse::<f64>().is_ok())
}

/// A column's name without case, blanks, quotes and byte order marks.
pub(crate) fn plain(name: &str) -> String {
    let is_kept = |letter: &char| !letter.is_whitespace() && !['"', '\'', '\u{feff}'].contains(letter);
    name.chars().filter(is_kept).flat_map(char::to_lowercase).collect()
}

/// The error of the stream: no row is invalid CSV, since it is UTF-8 and of any length.
fn unreadable(error: csv::Error) -> anyhow::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => unwrapped(error),
        other => anyhow::anyhow!("{other:?}"),
    }
}

/// Line of a record. Its position is that of the reader before it skipped comments and blank lines.
fn line_of(record: &StringRecord, reader: &mut csv::Reader<Stream<'_>>) -> usize {
    reader.get_mut().line_at(record.position().map_or(0, csv::Position::byte))
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

    /// The texts of all cells.
    pub(crate) fn cells(&self) -> impl Iterator<Item = &str> {
        self.record.iter()
    }

    /// File, line and column of a cell, for messages.
    pub fn place(&self, column: usize) -> String {
        format!(
            "{}, {} {}, column {}",
            self.name,
            self.numbering.word(),
            self.line,
            excerpt(&self.header[column]).replace(['\n', '\r'], " ")
        )
    }

    /// What the row's number is called, `line` or `row`.
    pub(crate) fn numbered(&self) -> &'static str {
        self.numbering.word()
    }

    /// The number in a cell, `None` if it has none; NaN and infinities are numbers here.
    fn any_number(&self, column: usize) -> Result<Option<f64>> {
        self.numbers.parse(self.text(column), column, self.line, || self.place(column))
    }

    /// True if a cell holds a finite number.
    pub fn is_number(&self, column: usize) -> bool {
        self.numbers.value(self.text(column)).is_some_and(f64::is_finite)
    }

    /// A finite number.
    ///
    /// # Errors
    /// [`BadInput`] with file, line and column.
    pub fn number(&self, column: usize) -> Result<f64> {
        let number = self.any_number(column)?.filter(|number| number.is_finite());
        number.ok_or_else(|| self.is_not(column, "a finite number"))
    }

    /// A finite number of at most `most` in magnitude.
    ///
    /// # Errors
    /// [`BadInput`] with file, line and column.
    pub fn number_within(&self, column: usize, most: f64) -> Result<f64> {
        let value = self.number(column)?;
        let most_shown = number(most);
        let within = (value.abs() <= most).then_some(value);
        within.ok_or_else(|| self.is_not(column, &format!("a number from -{most_shown} to {most_shown}")))
    }

    /// A finite number of at most `most` in magnitude, or `None` for a cell with a dash.
    ///
    /// # Errors
    /// [`BadInput`] with file, line and column.
    pub fn number_or_dash(&self, column: usize, most: f64) -> Result<Option<f64>> {
        match self.text(column) {
            "-" => Ok(None),
            "" => Err(self.is_not(column, "a finite number, or `-` for a missing reading")),
            _ => self.number_within(column, most).map(Some),
        }
    }

    /// A whole number, 0 or more.
    ///
    /// # Errors
    /// [`BadInput`] with file, line and column.
    pub fn whole(&self, column: usize) -> Result<usize> {
        self.text(column).parse().map_err(|_| self.is_not(column, "a whole number"))
    }

    /// The error for a cell that is not `what`.
    pub fn is_not(&self, column: usize, what: &str) -> anyhow::Error {
        let (text, place) = (self.text(column), self.place(column));
        let expected = what.split_once("; expected").map_or(what, |(expected, _)| expected);
        if text.is_empty() {
            return BadInput(format!("{place}: no value; expected {expected}")).into();
        }
        if unclosed(text) {
            return BadInput(format!("{place}: {UNCLOSED}; expected {expected}")).into();
        }
        BadInput(format!("{place}: `{}` is not {what}{}", excerpt(text), self.numbers.hint(text))).into()
    }
}
