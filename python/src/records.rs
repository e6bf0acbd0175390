//! The options of a record, which have the meaning of the command's, and its rows.

use std::path::{Path, PathBuf};

use anyhow::Result;
use identify::Input;
use pyo3::prelude::*;
use record_files::Container;
use simulation::bad_input;
use simulation::csv_table::Numbering;
use simulation::csv_table::dialect::{Dialect, Separator};
use simulation::record::columns::Column;
use simulation::record::{ColumnNames, Format, MeasuredRecord, Record, columns_file, remarks_on};

use crate::table::Cells;

/// A record as Python hands it over: its name and columns, or the path of a file and no columns.
pub(crate) type Given<'py> = (String, Option<Vec<(String, Cells<'py>)>>);

/// A record in memory of its own.
pub(crate) type Owned = (String, Option<Vec<(String, Column)>>);

/// Columns, units and format, by the names of the command's options.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Options {
    time: Option<String>,
    voltage: Option<String>,
    reading: Option<String>,
    column: Option<String>,
    columns: Option<PathBuf>,
    separator: Option<String>,
    decimal: Option<String>,
    topic: Option<String>,
    sort: bool,
    input: Option<String>,
}

/// Records of one spring.
pub(crate) struct Records {
    pub(crate) measured: Vec<MeasuredRecord>,
    pub(crate) input: Input,
    /// What the user should know about how they were read, one line each.
    pub(crate) remarks: Vec<String>,
}

/// The name of a column that says its unit, as the command makes it of the units in a file.
#[pyfunction]
pub(crate) fn with_unit(name: &str, unit: &str) -> String {
    simulation::record::with_unit(name, unit)
}

/// Copies the columns of records, so that they can be read without the interpreter's lock.
pub(crate) fn copied(records: Vec<Given<'_>>) -> Vec<Owned> {
    let copied = |columns: Vec<(String, Cells<'_>)>| {
        columns.into_iter().map(|(name, cells)| (name, cells.copied())).collect::<Vec<_>>()
    };
    records.into_iter().map(|(name, columns)| (name, columns.map(copied))).collect()
}

impl Options {
    /// Reads records, all in the same way.
    ///
    /// # Errors
    /// [`simulation::BadInput`] with the record, line, column and what was expected.
    pub(crate) fn open(self, records: &[Owned]) -> Result<Records> {
        let topic = self.topic.clone();
        let (format, input) = self.format()?;
        let read = |(name, columns): &Owned| match columns {
            None => {
                let (path, mut format) = (Path::new(name), format.clone());
                if Container::of(path).is_some() {
                    // A file of options may be of CSV files too.
                    format.dialect = Dialect::default();
                }
                record_files::open(path, &format, topic.as_deref())
            }
            Some(columns) => {
                let mut format = format.clone();
                format.dialect.separator = Some(Separator::COMMA);
                format.dialect.decimal = format.dialect.decimal.filter(|_| columns.iter().any(has_decimal_commas));
                format.read_columns(name, columns, Numbering::Lines)
            }
        };
        let measured: Vec<MeasuredRecord> = records.iter().map(read).collect::<Result<_>>()?;
        if measured.is_empty() {
            bad_input!("no record; expected one or more");
        }
        let remarks = remarks_on(&measured)?;
        Ok(Records { measured, input, remarks })
    }

    /// The options together with those of the file `columns`; options win.
    fn format(self) -> Result<(Format, Input)> {
        if self.reading.is_some() && self.column.is_some() {
            bad_input!("--column and --reading: both name the reading; expected one of them");
        }
        let columns =
            ColumnNames { time: self.time, voltage: self.voltage, reading: self.reading, stiffness: self.column };
        let separator = self.separator.map(|it| it.parse()).transpose()?;
        let decimal = self.decimal.map(|it| it.parse()).transpose()?;
        let given = Format { columns, dialect: Dialect { separator, decimal }, sort: self.sort };
        let (in_file, named) = match &self.columns {
            Some(path) => columns_file::open(path)?,
            None => (Format::default(), None),
        };
        let input = self.input.or(named).map(|name| name.parse()).transpose()?;
        Ok((given.or(in_file), input.unwrap_or_default()))
    }
}

/// True for a column of texts with commas. Others hold numbers, which have no decimal mark, or time stamps.
fn has_decimal_commas((_, column): &(String, Column)) -> bool {
    matches!(column, Column::Texts(cells) if cells.iter().any(|cell| cell.contains(',')))
}

impl Records {
    /// The rows alone.
    pub(crate) fn rows(&self) -> Vec<Record> {
        self.measured.iter().map(|measured| measured.record.clone()).collect()
    }
}
