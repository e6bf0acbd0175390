//! Records of an experiment as CSV: the columns `time_s`, `voltage_v` and optionally a measured one. Records with other
//! columns and units are opened by [`Format`], and those of files without lines come as [`columns`].

pub mod columns;
pub mod columns_file;
pub mod gaps;
mod measured;
mod missing;
mod names;
mod times;

pub use measured::{Format, MeasuredRecord, remarks_on};
pub use names::{ColumnNames, with_unit};
pub use times::is_like_date;

use std::path::Path;

use anyhow::Result;

use crate::bad_input;
use crate::bad_input::number;
use crate::csv_table::Table;
use crate::csv_table::dialect::Dialect;
use crate::csv_table::text::Source;

/// One row of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Line of the file, or number of the row in a file without lines; counted from 1.
    pub line: usize,
    /// Time, in s, increasing from row to row.
    pub time_s: f64,
    /// Commanded voltage, in V.
    pub voltage_v: f64,
    /// Reading in its own unit, by default stiffness as the equivalent static voltage in V; `None` if it is missing.
    pub measured: Option<f64>,
}

impl Row {
    /// Returns the row with `offset` subtracted from its reading.
    pub fn less(&self, offset: f64) -> Self {
        Self { measured: self.measured.map(|reading| reading - offset), ..*self }
    }
}

/// A validated record: at least two rows, all numbers finite, times increasing.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Name of the record in messages.
    pub name: String,
    /// The rows in order of time.
    pub rows: Vec<Row>,
}

/// Largest magnitude of a voltage, in V; anything larger is an error of the file.
const MOST_V: f64 = 1e6;

/// Largest magnitude of a reading, in its unit: larger than the Young's moduli in Pa and the counts of any instrument.
const MOST_READING: f64 = 1e15;

/// Column of the voltage across the spring, in files that lack the commanded voltage.
pub const APPLIED: &str = "applied_v";

/// Column of the controller's own estimate of the stiffness, recorded where the MCU has no sensor: no measurement.
pub const ESTIMATE: &str = "estimate";

/// Default name of the measured column.
pub const MEASURED: &str = "stiffness";

impl Record {
    /// Checks that all voltages lie within an amplifier's range.
    ///
    /// # Errors
    /// [`crate::bad_input::BadInput`] with file, line and column of the first voltage outside `lowest_v` to
    /// `highest_v`.
    pub fn check_range(&self, lowest_v: f64, highest_v: f64) -> Result<()> {
        match self.rows.iter().find(|row| !(lowest_v..=highest_v).contains(&row.voltage_v)) {
            None => Ok(()),
            Some(Row { line, voltage_v, .. }) => bad_input!(
                "{}, line {line}, column voltage_v: {voltage_v} V; expected {lowest_v} to {highest_v} V, the amplifier's range",
                self.name
            ),
        }
    }

    /// Reads a record from a file. `measured` names the measured column, which may be absent if it is [`MEASURED`].
    ///
    /// # Errors
    /// [`crate::bad_input::BadInput`] with file, line, column and what was expected.
    pub fn open(path: &Path, measured: &str) -> Result<Self> {
        Self::read(Source::open(path)?.expect_utf_8(), measured)
    }

    /// Parses a record; `name` is what messages call it.
    ///
    /// # Errors
    /// The errors of [`Record::open`].
    pub fn parse(name: &str, text: &str, measured: &str) -> Result<Self> {
        Self::read(Source::read(name, text.as_bytes()), measured)
    }

    fn read(source: Source<'_>, measured: &str) -> Result<Self> {
        let table = Table::read(source, Dialect::default())?;
        if let Some(titles) = table.titles() {
            bad_input!("{titles}; expected comments only, lines that start with `#`");
        }
        // Only the default column may be absent.
        let measured = (measured != MEASURED || table.find(measured).is_some()).then_some(measured);
        Self::from_table(table, measured)
    }

    fn from_table(mut table: Table<'_>, measured: Option<&str>) -> Result<Self> {
        let expected: Vec<&str> = ["time_s", "voltage_v"].into_iter().chain(measured).collect();
        let expected = expected.join(", ");
        let time = table.require("time_s", &expected)?;
        let voltage = table.require("voltage_v", &expected)?;
        let measured = measured.map(|column| table.require(column, &expected)).transpose()?;

        for (index, quantity) in [(time, "time"), (voltage, "voltage")] {
            if measured == Some(index) {
                return Err(table.is_taken(index, quantity, "--column").into());
            }
        }

        let name = table.name().to_owned();
        let mut rows: Vec<Row> = Vec::new();
        while let Some(row) = table.next_row()? {
            let row = Row {
                line: row.line,
                time_s: row.number(time)?,
                voltage_v: row.number_within(voltage, MOST_V)?,
                measured: measured.map_or(Ok(None), |column| row.number_or_dash(column, MOST_READING))?,
            };
            if let Some(last) = rows.last()
                && row.time_s <= last.time_s
            {
                bad_input!(
                    "{name}, line {}, column time_s: {} follows {}; expected increasing times after line {}",
                    row.line,
                    number(row.time_s),
                    number(last.time_s),
                    last.line
                );
            }
            rows.push(row);
        }
        if rows.len() < 2 {
            bad_input!("{name}: {} row(s) of data; expected at least 2", rows.len());
        }
        Ok(Self { name, rows })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bad_input::BadInput;

    fn message(text: &str) -> String {
        let error = Record::parse("data.csv", text, MEASURED).unwrap_err();
        error.downcast_ref::<BadInput>().expect("bad input").0.clone()
    }

    #[test]
    fn columns_may_be_in_any_order_with_comments_between() {
        let text = "# a\r\nstiffness,voltage_v,time_s\r\n0,100,1\r\n# b\r\n5, 200 ,2";
        let record = Record::parse("r", text, MEASURED).unwrap();
        assert_eq!(record.rows[1], Row { line: 5, time_s: 2.0, voltage_v: 200.0, measured: Some(5.0) });
    }

    #[test]
    fn another_existing_column_can_be_the_measured_one() {
        let text = "time_s,voltage_v,gauge\n0,0,7\n1,0,8\n";
        assert_eq!(Record::parse("r", text, "gauge").unwrap().rows[1].measured, Some(8.0));
        assert_eq!(Record::parse("r", text, MEASURED).unwrap().rows[1].measured, None);
        let gap = Record::parse("r", "time_s,voltage_v,stiffness\n0,0,-\n1,0,-8\n", MEASURED).unwrap();
        assert_eq!(gap.rows.iter().map(|row| row.measured).collect::<Vec<_>>(), [None, Some(-8.0)]);
        let error = Record::parse("r", text, "scale").unwrap_err().to_string();
        assert!(error.contains("no column `scale`; expected a header with time_s, voltage_v, scale"), "{error}");
        for (column, quantity) in [("time_s", "time"), ("voltage_v", "voltage")] {
            let error = Record::parse("r", text, column).unwrap_err().to_string();
            let expected = format!("r, line 1: column `{column}` is the {quantity}; expected another one for --column");
            assert_eq!(error, expected);
        }
    }

    #[test]
    fn required_readings_accept_the_applied_voltage() {
        let open = |text: &str| Format::default().read(Source::new("r", text)).map(|measured| measured.record);
        let error = open("# a\ntime_s,voltage_v\n0,1\n1,2\n").unwrap_err().to_string();
        assert!(error.starts_with("r, line 2: no column `stiffness`"), "{error}");
        let text = "time_s,target_v,applied_v,stiffness\n0,1,2,3\n1,1,2,3\n";
        assert_eq!(open(text).unwrap().rows[1].voltage_v, 2.0);
        assert!(Record::parse("r", text, MEASURED).is_err(), "a schedule needs the commanded voltage");
        let both = "time_s,applied_v,voltage_v,stiffness\n0,1,2,3\n1,1,2,3\n";
        assert_eq!(open(both).unwrap().rows[1].voltage_v, 2.0);
    }

    #[test]
    fn every_error_names_its_place() {
        for (text, expected) in [
            ("", "data.csv: no header; expected one with time_s, voltage_v"),
            ("\n# a\n\n", "data.csv: no header; expected one with time_s, voltage_v"),
            ("# a\ntime_s,voltage_v,time_s\n0,1,2\n", "line 2: column `time_s` appears twice"),
            ("time_s,voltage_v\n0,1\n  \n", "1 row(s) of data; expected at least 2"),
            (
                "time_s;voltage_v\n0;0\n1;500\n2;1,200\n",
                "line 4, column voltage_v: `1,200` can have a decimal comma or",
            ),
            ("time_s,volts\n0,1\n", "line 1: no column `voltage_v`"),
            ("time_s,voltage_v\n", "0 row(s) of data; expected at least 2"),
            (
                "by X\ntime_s,voltage_v\n0,1\n1,2\n",
                "1 line(s) above the header in line 2; expected comments only, lines that start with `#`",
            ),
            ("time_s,voltage_v\n0,1\n", "1 row(s)"),
            ("time_s,voltage_v\n0,1\n1,abc\n", "line 3, column voltage_v: `abc` is not a finite number"),
            ("time_s,voltage_v\n0,1\n1,NaN\n", "line 3, column voltage_v: `NaN`"),
            ("time_s,voltage_v\ninf,1\n1,1\n", "line 2, column time_s: `inf`"),
            ("time_s,voltage_v\n0,1\n0,2\n", "line 3, column time_s: 0 follows 0; expected increasing times"),
            ("# a\n\ntime_s,voltage_v\r\n0,1\r\n# b\r\n\r\n1,x", "line 7, column voltage_v: `x`"),
            ("# a\ntime_s,volts\n0,1\n", "line 2: no column `voltage_v`"),
            ("time_s,voltage_v\n0,1\n1\n", "line 3: 1 field(s); expected 2 as in the header"),
            (
                "time_s,voltage_v\n0,1\n1,-2e6\n",
                "line 3, column voltage_v: `-2e6` is not a number from -1000000 to 1000000",
            ),
            ("time_s,voltage_v,stiffness\n0,1,1e300\n", "line 2, column stiffness: `1e300`"),
            (
                "time_s,voltage_v,stiffness\n0,1,\n1,2,3\n",
                "line 2, column stiffness: no value; expected a finite number, or `-` for a missing reading",
            ),
            ("time_s,voltage_v\n1e300,1\n0,1\n", "line 3, column time_s: 0 follows 1e300; expected increasing times"),
            (&format!("time_s,voltage_v\n0,{}\n1,2\n", "7".repeat(400)), &format!("`{}...` is", "7".repeat(40))),
            (&format!("{}\n0,1\n", "t".repeat(400)), &format!("found `{}...`", "t".repeat(40))),
            (&format!("{0},{0}\n0,1\n", "t".repeat(400)), &format!("column `{}...` appears", "t".repeat(40))),
            (
                "time_s,voltage_v\n0,\"1\n1,2\n",
                "line 2, column voltage_v: a line break, perhaps after an unclosed quote; expected a finite number",
            ),
            (
                "time_s,voltage_v\n0,1\n\"1,2\n2,3\n",
                "line 3: 1 field(s) with a line break, perhaps after an unclosed quote; expected 2",
            ),
            (
                "time_s,\"voltage_v\n0,1\n",
                "line 1: a line break, perhaps after an unclosed quote; expected a header with time_s, voltage_v",
            ),
        ] {
            let got = message(text);
            assert!(got.starts_with("data.csv") && got.contains(expected), "{text:?}: {got}");
            assert!(!got.contains('\n'), "more than one line: {got}");
        }
    }
}
