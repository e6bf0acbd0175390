//! A table as a file: its columns first, then its rows one after the other.

mod mcap;
mod parquet;

use std::io::Write;

use anyhow::Result;

use crate::Container;

/// What the cells of a column are; any of them may be missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Doubles.
    Number,
    /// Whole numbers.
    Whole,
    /// Texts.
    Text,
}

/// A column of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name, as in the CSV file of the same table.
    pub name: &'static str,
    /// Unit, empty for a quantity without one.
    pub unit: &'static str,
    /// What the cells are.
    pub kind: Kind,
}

impl Column {
    /// A column of doubles.
    pub const fn number(name: &'static str, unit: &'static str) -> Self {
        Self { name, unit, kind: Kind::Number }
    }

    /// A column of whole numbers without unit.
    pub const fn whole(name: &'static str) -> Self {
        Self { name, unit: "", kind: Kind::Whole }
    }

    /// A column of texts.
    pub const fn text(name: &'static str) -> Self {
        Self { name, unit: "", kind: Kind::Text }
    }
}

/// A cell of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell<'a> {
    /// There is no value.
    Missing,
    /// Cell of a column of doubles; one that is not finite is missing.
    Number(f64),
    /// Cell of a column of whole numbers.
    Whole(i64),
    /// Cell of a column of texts.
    Text(&'a str),
}

impl From<Option<f64>> for Cell<'_> {
    fn from(number: Option<f64>) -> Self {
        number.map_or(Self::Missing, Self::Number)
    }
}

/// A table to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet<'a> {
    /// Name of what a row is, and of an MCAP file's topic: `record`, `stair`, `log`.
    pub name: &'a str,
    /// Where the table comes from, as a sentence.
    pub source: &'a str,
    /// The columns.
    pub columns: &'a [Column],
}

/// Writes a table. What has been added is in the file after [`Writer::flush`], and the file is whole after [`Writer::finish`].
pub enum Writer<W: Write + Send> {
    /// A writer of an MCAP file.
    Mcap(Box<mcap::Writer<W>>),
    /// A writer of a Parquet file.
    Parquet(Box<parquet::Writer<W>>),
}

impl<W: Write + Send> Writer<W> {
    /// Writes the beginning of a file.
    ///
    /// # Errors
    /// If `out` cannot be written.
    pub fn new(container: Container, sheet: &Sheet<'_>, out: W) -> Result<Self> {
        Ok(match container {
            Container::Mcap => Self::Mcap(Box::new(mcap::Writer::new(sheet, out)?)),
            Container::Parquet => Self::Parquet(Box::new(parquet::Writer::new(sheet, out)?)),
        })
    }

    /// Adds a row at a time in ns: since 1970, or of a clock that starts at 0. Its cells are those of the columns, in their
    /// order.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn row(&mut self, time_ns: u64, cells: &[Cell<'_>]) -> Result<()> {
        match self {
            Self::Mcap(writer) => writer.row(time_ns, cells),
            Self::Parquet(writer) => writer.row(cells),
        }
    }

    /// Brings an MCAP file to a state in which all rows so far can be read, whatever happens then; a Parquet file can be read
    /// only when it is finished.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn flush(&mut self) -> Result<()> {
        match self {
            Self::Mcap(writer) => writer.flush(),
            Self::Parquet(_) => Ok(()),
        }
    }

    /// Writes the end of the file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self) -> Result<()> {
        match self {
            Self::Mcap(writer) => writer.finish(),
            Self::Parquet(writer) => writer.finish(),
        }
    }
}
