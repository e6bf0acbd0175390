//! A measured record as its instrument wrote it: any column names, units, separators and usual encodings.

use std::path::Path;

use anyhow::Result;

use super::columns;
use super::gaps::{median_interval, missed_turns};
use super::missing::{self, is_missing};
use super::names::{Column, ColumnNames, Columns};
use super::times::{Clock, Time, is_stamp};
use super::{MOST_READING, MOST_V, Record, Row};
use crate::bad_input;
use crate::bad_input::{BadInput, excerpt, number};
use crate::csv_table::dialect::{Decimal, Dialect, Separator};
use crate::csv_table::text::Source;
use crate::csv_table::{Numbering, Table};
use crate::units::{Unit, Units, are_labels, usual, usual_volts};

/// How to read a file with a measured record; everything that is not said is found in the file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Format {
    /// The columns and their units.
    pub columns: ColumnNames,
    /// Separator and decimal mark.
    pub dialect: Dialect,
    /// True if rows may be in any order and occur twice.
    pub sort: bool,
}

/// A measured record, and what its file says about itself.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredRecord {
    /// The record: times in s, voltages in V, readings in their own unit.
    pub record: Record,
    /// The units of the file.
    pub units: Units,
    /// Name of the column of the readings.
    pub column: String,
    /// What the user should know about how the file was read, one line each.
    pub remarks: Vec<String>,
}

impl MeasuredRecord {
    /// Checks that commands and readings are quantities of the same kind as those of another record of the same spring.
    ///
    /// # Errors
    /// [`BadInput`] with the record and the unit that was expected.
    pub fn expect_quantities_of(&self, other: &Self) -> Result<(), BadInput> {
        let of_command =
            |units: &Units| usual_volts(&units.voltage.name).map_or(units.voltage.name.clone(), |_| "V".into());
        let of_reading = |units: &Units| units.reading.clone();
        let kinds = |of: &dyn Fn(&Units) -> String| (of(&self.units), of(&other.units));
        for (quantity, (own, expected)) in [("voltage", kinds(&of_command)), ("reading", kinds(&of_reading))] {
            if own != expected {
                let (name, of) = (&self.record.name, &other.record.name);
                return Err(BadInput(format!("{name}: unit of the {quantity}: {own}; expected {expected} as in {of}")));
            }
        }
        Ok(())
    }
}

/// Checks that the records can be of one spring; returns what the user should know about all of them, one line each.
///
/// # Errors
/// [`BadInput`] with the first record whose quantities are not those of the first one.
pub fn remarks_on(records: &[MeasuredRecord]) -> Result<Vec<String>, BadInput> {
    for record in records.iter().skip(1) {
        record.expect_quantities_of(&records[0])?;
    }
    let missed = |MeasuredRecord { record, .. }: &MeasuredRecord| {
        let turns = missed_turns(&record.rows);
        (turns > 0).then(|| {
            format!(
                "{}: the voltage turns in {turns} gap(s) between the rows; what it did there is not in the record and may be taken \
                 for a property of the spring",
                record.name
            )
        })
    };
    let of_files = records.iter().flat_map(|record| record.remarks.iter().cloned());
    Ok(of_files.chain(records.iter().filter_map(missed)).collect())
}

/// Longest record, in s: beyond, squares of times approach the end of the doubles.
const LONGEST_S: f64 = 1e15;
/// Longest record, in median intervals between its rows: doubles then still resolve a thousandth of an interval.
const LONGEST_INTERVALS: f64 = 1e12;

/// Name of the unit of a reading without unit.
const NO_UNIT: &str = "units";

impl Format {
    /// Returns this format, with what it does not say taken from `other`.
    pub fn or(self, other: Self) -> Self {
        let ColumnNames { time, voltage, reading, stiffness } = other.columns;
        let own = self.columns;
        Self {
            columns: ColumnNames {
                time: own.time.or(time),
                voltage: own.voltage.or(voltage),
                reading: own.reading.or(reading),
                stiffness: own.stiffness.or(stiffness),
            },
            dialect: Dialect {
                separator: self.dialect.separator.or(other.dialect.separator),
                decimal: self.dialect.decimal.or(other.dialect.decimal),
            },
            sort: self.sort || other.sort,
        }
    }

    /// Reads a record from a file.
    ///
    /// # Errors
    /// [`BadInput`] with file, line, column and what was expected.
    pub fn open(&self, path: &Path) -> Result<MeasuredRecord> {
        self.read(Source::open(path)?)
    }

    /// Indices of the columns of time, voltage and reading among the columns with these names, of a file that has rows and no
    /// lines.
    ///
    /// # Errors
    /// [`BadInput`] that lists the columns and an option line that names them.
    pub fn indices<'a>(&self, name: &str, columns: impl IntoIterator<Item = &'a str>) -> Result<[usize; 3]> {
        let header = columns::header(columns);
        let dialect = Dialect { separator: Some(Separator::COMMA), ..self.dialect };
        let columns = self.columns.find(&Table::read(Source::of_columns(name, header, Numbering::Rows), dialect)?)?;
        Ok([columns.time, columns.voltage, columns.reading].map(|column| column.index))
    }

    /// Reads a record from columns in memory; `name` is what messages call it.
    ///
    /// # Errors
    /// The errors of [`Format::open`], and [`BadInput`] for durations that the format takes for numbers in another unit than s.
    pub fn read_columns(
        &self,
        name: &str,
        columns: &[(String, columns::Column)],
        numbering: Numbering,
    ) -> Result<MeasuredRecord> {
        let measured = self.read(Source::of_columns(name, columns::text(name, columns)?, numbering))?;
        let indices = self.indices(name, columns.iter().map(|(column, _)| column.as_str()))?;
        let Units { time, voltage, reading } = &measured.units;
        for (index, unit) in indices.into_iter().zip([&time.name, &voltage.name, reading]) {
            let (column, cells) = &columns[index];
            if matches!(cells, columns::Column::Durations(_)) && unit != "s" {
                let column = excerpt(column).replace(['\n', '\r'], " ");
                bad_input!("{name}, column {column}: durations, not numbers in {unit}; expected numbers, or no unit");
            }
        }
        Ok(measured)
    }

    /// Reads a record from the bytes of a file.
    ///
    /// # Errors
    /// The errors of [`Format::open`].
    pub fn read(&self, source: Source<'_>) -> Result<MeasuredRecord> {
        let (name, numbering) = (source.name.clone(), source.numbering());
        let dialect = match numbering {
            Numbering::Lines => self.dialect,
            Numbering::Rows => Dialect { separator: Some(Separator::COMMA), decimal: Some(Decimal::Point) },
        };
        let mut table = Table::read(source, dialect)?;
        let columns = self.columns.find(&table)?;
        let has_labels = skip_labels(&mut table)?;
        let below_header = below_header(&mut table, &columns)?;
        let units = self.units(&columns, &below_header)?;
        let mut rows =
            Rows { table: &mut table, columns: &columns, units: &units, clock: Clock::default(), sort: self.sort };
        let mut timed = rows.read()?;
        let (has_stamps, dates) = (rows.clock.has_stamps(), rows.clock.dates());
        let mut remarks: Vec<String> = table.remarks().collect();
        if has_labels {
            remarks.push(format!("{name}: letters of channels below the header, skipped"));
        }
        if below_header.iter().any(Option::is_some) {
            let shown = below_header.each_ref().map(|unit| unit.as_deref().unwrap_or("-"));
            remarks.push(format!("{name}: units {} below the header", shown.join(", ")));
        }
        let [time, voltage, reading] = &below_header;
        for (column, below, unit, needs_unit) in [
            (&columns.time, time, &units.time.name, !has_stamps),
            (&columns.voltage, voltage, &units.voltage.name, true),
            (&columns.reading, reading, &units.reading, false),
        ] {
            let shown = excerpt(table.column(column.index));
            let is_used = |below: &String| below == unit || usual(below).as_ref() == Some(unit);
            let other = below.as_ref().and_then(|below| {
                if is_used(below) { column.unit.as_ref().filter(|own| *own != unit) } else { Some(below) }
            });
            match below {
                Some(_) => {
                    let not = other.map(|other| format!("{name}: column `{shown}` is read in {unit}, not in {other}"));
                    remarks.extend(not);
                }
                None if needs_unit && column.unit.is_none() => {
                    remarks.push(format!("{name}: column `{shown}` has no unit; read in {unit}"));
                }
                None => (),
            }
        }
        if self.sort {
            timed = sorted(&name, numbering, timed, &mut remarks)?;
        }
        let missing = timed.iter().filter(|(_, row)| row.measured.is_none()).count();
        if missing > 0 {
            remarks.push(format!("{name}: {missing} of {} rows without a reading", timed.len()));
        }
        let from_first = has_stamps || are_closer_than_digits(&timed);
        if from_first {
            remarks.push(format!("{name}: times are counted from the first row"));
        }
        if let Some(dates) = dates {
            remarks.push(format!("{name}: the days of the times are in column `{}`", excerpt(table.column(dates))));
        }
        // Sorted, the earliest row is the first one.
        let first = timed.first().map_or(0.0, |(time, _)| time.since_first);
        let time_of = |time: Time| if from_first { time.since_first - first } else { time.value };
        let rows = timed.into_iter().map(|(time, row)| Row { time_s: time_of(time) * units.time.si, ..row });
        let rows: Vec<Row> = rows.collect();
        let start_s = rows.first().map_or(0.0, |row| row.time_s);
        let longest_s = LONGEST_S.min(LONGEST_INTERVALS * median_interval(&rows).unwrap_or(LONGEST_S));
        let is_late = |row: &&Row| row.time_s - start_s > longest_s || !row.time_s.is_finite();
        if let Some(Row { line, time_s, .. }) = rows.iter().find(is_late) {
            let column = excerpt(table.column(columns.time.index)).replace(['\n', '\r'], " ");
            let (after_s, longest_s) = (number(time_s - start_s), number(longest_s));
            bad_input!(
                "{name}, {} {line}, column {column}: {after_s} s after the first row; expected at most {longest_s} s for rows \
                 as close as these",
                numbering.word()
            );
        }
        let column = table.column(columns.reading.index).to_owned();
        let record = Record { name, rows };
        Ok(MeasuredRecord { record, units, column, remarks })
    }

    /// The units: those asked for, else usual ones in the row below the header, else those in the columns' names, else any in the
    /// row, else s and V; a reading has no unit unless its column is that of this program's records.
    fn units(&self, columns: &Columns, below_header: &[Option<String>; 3]) -> Result<Units> {
        let of = |column: &Column, index: usize| {
            let below = below_header[index].clone();
            // The first row may be one of words, not of units.
            let said = below.clone().filter(|unit| !column.is_asked && usual(unit).is_some());
            said.or_else(|| column.unit.clone()).or(below)
        };
        let default = Units::default();
        let time = match of(&columns.time, 0) {
            Some(unit) => Unit::of_time(&unit).map_err(|error| match &self.columns.time {
                Some(asked) => BadInput(format!("--time {asked}: {error}")),
                None => BadInput(format!("the column of times: {error}")),
            })?,
            None => default.time,
        };
        let voltage = of(&columns.voltage, 1).map_or(default.voltage, |unit| Unit::of_voltage(&unit));
        let without = if self.columns.reading.is_none() { default.reading.clone() } else { NO_UNIT.to_owned() };
        let reading = match self.columns.stiffness {
            Some(_) => default.reading,
            None => of(&columns.reading, 2).unwrap_or(without),
        };
        Ok(Units { time, voltage, reading })
    }
}

/// Skips a row that labels channels with letters; returns false if the next row is another one.
fn skip_labels(table: &mut Table<'_>) -> Result<bool> {
    let Some(row) = table.next_row()? else { return Ok(false) };
    let has_labels = are_labels(row.cells());
    if !has_labels {
        table.return_row();
    }
    Ok(has_labels)
}

/// The units of time, voltage and reading in the next row below the header, if it is a row of units; any other one is still to
/// be read. Above time stamps a unit of time says nothing.
///
/// # Errors
/// [`BadInput`] for a unit of time that is none, where the column does not have another one.
fn below_header(table: &mut Table<'_>, columns: &Columns) -> Result<[Option<String>; 3]> {
    const BRACKETS: [char; 5] = ['[', ']', '(', ')', ' '];
    let in_order = [&columns.time, &columns.voltage, &columns.reading].map(|column| column.index);
    let time = columns.time.index;
    let Some(row) = table.next_row()? else { return Ok([None, None, None]) };
    let mut units = in_order.map(|column| {
        let unit = row.text(column).trim_matches(BRACKETS);
        (!is_missing(unit)).then(|| unit.to_owned())
    });
    let unit_of_time = units[0].as_deref().map(Unit::of_time).transpose();
    let is_of_units = (units[1..].iter().any(Option::is_some) || matches!(unit_of_time, Ok(Some(_))))
        && !in_order.iter().any(|column| row.is_number(*column))
        && !is_stamp(row.text(time));
    if !is_of_units {
        table.return_row();
        return Ok([None, None, None]);
    }
    let place = row.place(time);
    if let Some(first) = table.next_row()? {
        let has_stamps = is_stamp(first.text(time));
        table.return_row();
        match unit_of_time {
            _ if has_stamps => units[0] = None,
            Err(error) if columns.time.unit.is_none() => bad_input!("{place}: {error}"),
            _ => (),
        }
    }
    Ok(units)
}

/// The rows of a table in the order of the file, their times not yet in s.
struct Rows<'a, 't> {
    table: &'a mut Table<'t>,
    columns: &'a Columns,
    units: &'a Units,
    clock: Clock,
    sort: bool,
}

impl Rows<'_, '_> {
    fn read(&mut self) -> Result<Vec<(Time, Row)>> {
        let Columns { time, voltage, reading } = self.columns;
        let unit = &self.units.voltage;
        // Amplifiers end below a megavolt; a command in another unit may be a code or a force.
        let most_voltage = if usual_volts(&unit.name).is_some() { MOST_V / unit.si } else { MOST_READING };
        let mut rows: Vec<(Time, Row)> = Vec::new();
        while let Some(row) = self.table.next_row()? {
            let at = self.clock.read(&row, time.index)?;
            if self.clock.has_stamps()
                && let Some(unit) = &time.unit
            {
                bad_input!(
                    "{}: `{}` is a time stamp, not a number in {unit}; expected a number, or no unit of time",
                    row.place(time.index),
                    row.text(time.index)
                );
            }
            let voltage_v = row.number_within(voltage.index, most_voltage)? * unit.si;
            let measured = missing::reading(&row, reading.index, MOST_READING)?;
            if let Some((last, Row { line, .. })) = rows.last()
                && !self.sort
                && !at.is_after(*last)
            {
                bad_input!(
                    "{}: {} follows {}; expected increasing times after {} {line} (--sort orders them)",
                    row.place(time.index),
                    if self.clock.has_stamps() { row.text(time.index).to_owned() } else { number(at.value) },
                    if self.clock.has_stamps() { "a later or equal time".to_owned() } else { number(last.value) },
                    row.numbered()
                );
            }
            rows.push((at, Row { line: row.line, time_s: at.value, voltage_v, measured }));
        }
        if rows.len() < 2 {
            bad_input!("{}: {} row(s) of data; expected at least 2", self.table.name(), rows.len());
        }
        Ok(rows)
    }
}

/// True if times are so close to each other, compared with their size, that doubles keep fewer than four digits of the
/// distance.
fn are_closer_than_digits(rows: &[(Time, Row)]) -> bool {
    const DIGITS: f64 = 1e3;
    let (Some((first, _)), Some((last, _))) = (rows.first(), rows.last()) else { return false };
    first.value.abs() > last.since_first
        && rows.windows(2).any(|pair| {
            let distance = pair[1].0.since_first - pair[0].0.since_first;
            distance < DIGITS * f64::EPSILON * pair[1].0.value.abs()
        })
}

/// Orders rows by time; those at the same time become one, whose reading is the mean.
fn sorted(
    name: &str,
    numbering: Numbering,
    mut rows: Vec<(Time, Row)>,
    remarks: &mut Vec<String>,
) -> Result<Vec<(Time, Row)>> {
    let disordered = rows.windows(2).filter(|pair| pair[0].0.is_after(pair[1].0)).count();
    rows.sort_by(|(a, _), (b, _)| a.value.total_cmp(&b.value).then(a.since_first.total_cmp(&b.since_first)));
    let (mut merged, mut repeated, mut averaged) = (Vec::new(), 0, 0);
    for same in rows.chunk_by(|(a, _), (b, _)| !b.is_after(*a)) {
        let (time, mut row) = same[0];
        if let Some((_, other)) = same.iter().find(|(_, other)| other.voltage_v != row.voltage_v) {
            bad_input!(
                "{name}, {}s {} and {}: two voltages at the same time, {} V and {} V; expected one",
                numbering.word(),
                row.line,
                other.line,
                number(row.voltage_v),
                number(other.voltage_v)
            );
        }
        let readings: Vec<f64> = same.iter().filter_map(|(_, row)| row.measured).collect();
        row.measured = readings.first().copied();
        if readings.iter().any(|reading| Some(*reading) != row.measured) {
            averaged += 1;
            row.measured = Some(readings.iter().sum::<f64>() / readings.len() as f64);
        }
        repeated += same.len() - 1;
        merged.push((time, row));
    }
    for (count, what) in [
        (disordered, "row(s) earlier than the one above, sorted"),
        (repeated, "row(s) at the time of another, merged"),
        (averaged, "time(s) with different readings, averaged"),
    ] {
        if count > 0 {
            remarks.push(format!("{name}: {count} {what}"));
        }
    }
    if merged.len() < 2 {
        bad_input!("{name}: {} time(s); expected at least 2", merged.len());
    }
    Ok(merged)
}
