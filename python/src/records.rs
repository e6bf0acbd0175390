//! The options of a record, which have the meaning of the command's, and its rows.

use std::path::{Path, PathBuf};

use anyhow::Result;
use identify::Input;
use pyo3::prelude::*;
use simulation::bad_input;
use simulation::csv_table::text::Source;
use simulation::record::gaps::missed_turns;
use simulation::record::{Format, MeasuredRecord, Record, columns_file};
use simulation::schedule::Schedule;

use crate::table::{Cells, Column, source};

/// Tolerance in s within which a row of the stair may have the voltage before or after a step, as in `vsj diagnose`.
const RAMP_S: f64 = 0.1;

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

/// Copies the columns of records, so that they can be read without the interpreter's lock.
pub(crate) fn copied(records: Vec<Given<'_>>) -> Vec<Owned> {
    let copied = |columns: Vec<(String, Cells<'_>)>| {
        columns.into_iter().map(|(name, cells)| (name, cells.copied())).collect::<Vec<_>>()
    };
    records.into_iter().map(|(name, columns)| (name, columns.map(copied))).collect()
}

/// The course of the voltage between the rows by its name.
///
/// # Errors
/// [`simulation::BadInput`] for another name.
pub(crate) fn input(name: Option<&str>) -> Result<Input> {
    Ok(match name {
        None | Some("hold") => Input::Hold,
        Some("linear") => Input::Linear,
        Some("stair") => Input::Stair,
        Some(other) => bad_input!("--input {other}: expected hold, linear or stair"),
    })
}

impl Options {
    /// Reads records, all in the same way.
    ///
    /// # Errors
    /// [`simulation::BadInput`] with the record, line, column and what was expected.
    pub(crate) fn open(self, records: &[Owned]) -> Result<Records> {
        let (format, input) = self.format()?;
        let read = |(name, columns): &Owned| match columns {
            None => format.open(Path::new(name)),
            Some(columns) => {
                let mut format = format.clone();
                format.dialect.separator = Some(",".parse()?);
                let source: Source = source(name, columns)?;
                format.read(source)
            }
        };
        let measured: Vec<MeasuredRecord> = records.iter().map(read).collect::<Result<_>>()?;
        let Some((first, others)) = measured.split_first() else { bad_input!("no record; expected one or more") };
        for record in others {
            record.expect_quantities_of(first)?;
        }
        let mut remarks: Vec<String> = measured.iter().flat_map(|record| record.remarks.clone()).collect();
        for MeasuredRecord { record, .. } in &measured {
            let turns = missed_turns(&record.rows);
            if turns > 0 {
                remarks.push(format!(
                    "{}: the voltage turns in {turns} gap(s) between the rows; what it did there is not in the record and may be \
                     taken for a property of the spring",
                    record.name
                ));
            }
        }
        Ok(Records { measured, input, remarks })
    }

    /// The options together with those of the file `columns`; options win.
    fn format(self) -> Result<(Format, Input)> {
        if self.reading.is_some() && self.column.is_some() {
            bad_input!("--column and --reading: both name the reading; expected one of them");
        }
        let (mut format, named) = match &self.columns {
            Some(path) => columns_file::open(path)?,
            None => (Format::default(), None),
        };
        let columns = &mut format.columns;
        for (option, column) in [
            (self.time, &mut columns.time),
            (self.voltage, &mut columns.voltage),
            (self.reading, &mut columns.reading),
            (self.column, &mut columns.stiffness),
        ] {
            *column = option.or(column.take());
        }
        format.dialect.separator = self.separator.map(|it| it.parse()).transpose()?.or(format.dialect.separator);
        format.dialect.decimal = self.decimal.map(|it| it.parse()).transpose()?.or(format.dialect.decimal);
        format.sort |= self.sort;
        Ok((format, input(self.input.or(named).as_deref())?))
    }
}

impl Records {
    /// The rows alone.
    pub(crate) fn rows(&self) -> Vec<Record> {
        self.measured.iter().map(|measured| measured.record.clone()).collect()
    }

    /// Checks that records under the report's stair have its voltages.
    ///
    /// # Errors
    /// [`simulation::BadInput`] with the first row that has another voltage.
    pub(crate) fn check_stair(&self) -> Result<()> {
        if self.input == Input::Stair {
            for MeasuredRecord { record, .. } in &self.measured {
                Schedule::stair().check_commanded("the report's stair (--input stair)", record, RAMP_S)?;
            }
        }
        Ok(())
    }
}
