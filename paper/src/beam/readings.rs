//! Readings of the beam experiment (section 2.5, Table 1): force on the free end by its displacement.

use anyhow::Result;
use serde::Serialize;

use simulation::bad_input;
use simulation::csv_table::Table;

/// One reading of the balance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reading {
    /// Voltage across the spring, in V.
    pub voltage_v: f64,
    /// Displacement of the free end, in mm.
    pub displacement_mm: f64,
    /// Force, in uN.
    pub force_un: f64,
}

/// Columns that messages expect in a header.
const COLUMNS: &str = "displacement_mm, force_un_0v, force_un_400v, ...";

/// Largest number of voltages: each adds a curve to the answer and its plot.
const MOST_VOLTAGES: usize = 100;
/// Largest number of readings.
const MOST_READINGS: usize = 100_000;

/// Parses a table with the columns `displacement_mm` and `force_un_<V>v`, one for each voltage.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] with file, line, column and what was expected.
pub fn parse(name: &str, text: &str) -> Result<Vec<Reading>> {
    let mut table = Table::new(name, text)?;
    let displacement = table.require("displacement_mm", COLUMNS)?;
    let voltage = |column: &str| {
        let volts: f64 = column.strip_prefix("force_un_")?.strip_suffix('v')?.parse().ok()?;
        volts.is_finite().then_some(volts)
    };
    let voltages: Vec<(usize, f64)> =
        table.columns().enumerate().filter_map(|(index, column)| Some((index, voltage(column)?))).collect();
    if voltages.is_empty() {
        return Err(table.lacks("force_un_<V>v", COLUMNS).into());
    }
    if voltages.len() > MOST_VOLTAGES {
        bad_input!("{}: {} columns of forces; expected at most {MOST_VOLTAGES}", table.header_place(), voltages.len());
    }
    let mut readings = Vec::new();
    while let Some(row) = table.next_row()? {
        if readings.len() >= MOST_READINGS {
            bad_input!("{name}, line {}: more than {MOST_READINGS} readings; expected at most that", row.line);
        }
        let displacement_mm = row.number(displacement)?;
        for &(column, voltage_v) in &voltages {
            readings.push(Reading { voltage_v, displacement_mm, force_un: row.number(column)? });
        }
    }
    if readings.is_empty() {
        bad_input!("{name}: 0 rows of data; expected one a displacement");
    }
    Ok(readings)
}

/// The readings of the report's Table 1.
///
/// # Errors
/// If the built-in data file is damaged.
pub fn table1() -> Result<Vec<Reading>> {
    parse("data/table1_bending.csv", include_str!("../../../data/table1_bending.csv"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_invalid_table_is_rejected_in_one_line_with_its_place() {
        for (text, expected) in [
            ("force_un_0v\n1\n", "t, line 1: no column `displacement_mm`"),
            ("# a\ndisplacement_mm\n1\n", "t, line 2: no column `force_un_<V>v`"),
            ("displacement_mm,force_un_infv\n1,2\n", "t, line 1: no column `force_un_<V>v`"),
            ("displacement_mm,force_un_0v,force_un_0v\n1,2,3\n", "t, line 1: column `force_un_0v` appears twice"),
            ("displacement_mm,force_un_0v\n", "t: 0 rows of data"),
            ("# a\n", "t: no header; expected one with displacement_mm"),
            (
                "displacement_mm,force_un_0v\n1,2\n# a\n\n1,x\n",
                "t, line 5, column force_un_0v: `x` is not a finite number",
            ),
            ("displacement_mm,force_un_0v\nNaN,1\n", "t, line 2, column displacement_mm: `NaN`"),
            ("displacement_mm,force_un_0v\n1\n", "t, line 2: 1 field(s); expected 2"),
        ] {
            let error = parse("t", text).unwrap_err();
            assert!(
                error.is::<simulation::bad_input::BadInput>() && error.to_string().starts_with(expected),
                "{error}"
            );
        }
    }
}
