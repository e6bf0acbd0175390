//! The beam experiment (section 2.5, Table 1): supporting force against displacement of the free end, at several voltages.
//!
//! Each voltage is a line through the origin, all with one scatter; readings out of line are set aside one by one. Then
//!
//! ```text
//! F = (a + c V) x,   E(V) = (a + c V) L^3 / (3 I)
//! ```
//!
//! is fitted to all remaining readings at once: the report fits three Young's moduli, which leaves its interval one
//! degree of freedom.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

use super::cantilever::Beam;
use super::regression::{Fit, Interval};
use crate::bad_input;
use crate::bad_input::BadInput;

/// Table 1 as it was printed.
pub const TABLE1: &str = include_str!("../../../data/table1_bending.csv");

/// One reading of the balance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reading {
    /// Across the spring, in V.
    pub voltage_v: f64,
    /// Of the free end, in mm.
    pub displacement_mm: f64,
    /// In uN.
    pub force_un: f64,
}

/// What an experiment says. Intervals hold with 95 %.
#[derive(Clone, Debug, Serialize)]
pub struct Experiment {
    /// One a voltage, ascending.
    pub lines: Vec<Line>,
    /// Readings set aside, worst first.
    pub out_of_line: Vec<OutOfLine>,
    /// Young's modulus of the whole beam without voltage, in Pa.
    pub at_zero_pa: Interval,
    /// Its growth, in Pa/V.
    pub per_volt_pa: Interval,
    /// Chance of a curvature of E(V) as large as the readings show, if E(V) is straight.
    pub straight_chance: Option<f64>,
    /// Stiffness at the highest voltage by stiffness without.
    pub reach_ratio: Interval,
    /// Spring constant at the lowest and highest voltage, in N/m.
    pub reach_n_per_m: [Interval; 2],
}

/// One voltage.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// In V.
    pub voltage_v: f64,
    /// Spring constant through the origin from all readings, in uN/mm (mN/m).
    pub all_un_per_mm: Interval,
    /// Without the readings that are out of line.
    pub un_per_mm: Interval,
    /// Young's modulus of the whole beam from that, in Pa.
    pub youngs_modulus_pa: Interval,
}

/// A reading that the others contradict.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct OutOfLine {
    /// The reading.
    pub reading: Reading,
    /// What the others say, in uN.
    pub expected_un: Interval,
    /// Chance of that, if all readings are alike.
    pub chance: f64,
}

/// Reads a table with the columns `displacement_mm` and one `force_un_<V>v` a voltage.
///
/// # Errors
/// [`BadInput`] with file, line, column and what was expected.
pub fn open(path: &Path) -> Result<Vec<Reading>> {
    let name = path.display().to_string();
    match std::fs::read_to_string(path) {
        Ok(text) => parse(&name, &text),
        Err(error) => bad_input!("{name}: cannot be read: {error}"),
    }
}

/// As [`open`], from text.
///
/// # Errors
/// As [`open`].
pub fn parse(name: &str, text: &str) -> Result<Vec<Reading>> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let unreadable = |error: csv::Error| BadInput(format!("{name}: {error}; expected CSV"));
    let header = reader.headers().map_err(unreadable)?.clone();
    let voltage = |column: &str| column.strip_prefix("force_un_")?.strip_suffix('v')?.parse::<f64>().ok();
    let voltages: Vec<(usize, f64)> =
        header.iter().enumerate().filter_map(|(index, column)| Some((index, voltage(column)?))).collect();
    let Some(displacement) = header.iter().position(|column| column == "displacement_mm") else {
        bad_input!("{name}: no column `displacement_mm`; expected it beside force_un_0v, force_un_400v, ...");
    };
    if voltages.is_empty() {
        bad_input!("{name}: no column `force_un_<V>v`; expected one a voltage, such as force_un_400v");
    }
    let mut readings = Vec::new();
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        let number = |index: usize| match record[index].parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => {
                let line = record.position().map_or(0, csv::Position::line);
                let (column, found) = (&header[index], &record[index]);
                Err(BadInput(format!("{name}, line {line}, column {column}: `{found}` is not a finite number")))
            }
        };
        for &(index, voltage_v) in &voltages {
            let displacement_mm = number(displacement)?;
            readings.push(Reading { voltage_v, displacement_mm, force_un: number(index)? });
        }
    }
    Ok(readings)
}

/// The readings of Table 1.
///
/// # Errors
/// If the file that was built in is damaged.
pub fn table1() -> Result<Vec<Reading>> {
    parse("data/table1_bending.csv", TABLE1)
}

/// Lines through the origin, one a voltage, with one scatter for all.
///
/// # Errors
/// If there are too few readings.
pub fn lines(readings: &[Reading], voltages: &[f64]) -> Result<Fit> {
    let row = |reading: &Reading| {
        voltages.iter().map(|&v| if v == reading.voltage_v { reading.displacement_mm } else { 0.0 }).collect()
    };
    let forces: Vec<f64> = readings.iter().map(|reading| reading.force_un).collect();
    Fit::new(&readings.iter().map(row).collect::<Vec<_>>(), &forces)
}

/// The voltages of a table, ascending.
pub fn voltages(readings: &[Reading]) -> Vec<f64> {
    let mut voltages: Vec<f64> = readings.iter().map(|reading| reading.voltage_v).collect();
    voltages.sort_by(f64::total_cmp);
    voltages.dedup();
    voltages
}

impl Experiment {
    /// Evaluates readings made on `beam`, whose own Young's modulus is not looked at.
    ///
    /// # Errors
    /// [`BadInput`] for fewer than two voltages or too few readings.
    pub fn new(readings: &[Reading], beam: &Beam) -> Result<Self> {
        let voltages = voltages(readings);
        let &[lowest, .., highest] = &voltages[..] else {
            bad_input!("the beam experiment has {} voltage(s); expected at least two", voltages.len())
        };
        let fitted = |readings: &[Reading]| {
            lines(readings, &voltages).map_err(|error| BadInput(format!("the beam experiment: {error}")))
        };
        let all = fitted(readings)?;
        let (mut kept, mut out_of_line, mut fit) = (readings.to_vec(), Vec::new(), all.clone());
        while let Some(index) = fit.out_of_line() {
            let (expected_un, chance) = (fit.readings[index].expected, fit.readings[index].chance);
            out_of_line.push(OutOfLine { reading: kept.remove(index), expected_un, chance });
            fit = fitted(&kept)?;
        }
        // uN/mm is 1e-3 N/m.
        let pascal = |un_per_mm: Interval| un_per_mm.scaled(1e-3 * beam.youngs_modulus_of(1.0));
        let lines: Vec<Line> = (0..voltages.len())
            .map(|index| {
                let un_per_mm = fit.coefficient(index)?;
                Ok(Line {
                    voltage_v: voltages[index],
                    all_un_per_mm: all.coefficient(index)?,
                    un_per_mm,
                    youngs_modulus_pa: pascal(un_per_mm),
                })
            })
            .collect::<Result<_>>()?;

        let law = law(&kept, 1)?;
        let ratio_at = |value: f64| (law.coefficients[0] + law.coefficients[1] * highest) / value;
        let at_lowest = law.combined(&[1.0, lowest])?;
        // To first order: the interval of the difference of numerator and ratio times denominator.
        let ratio = ratio_at(at_lowest.value);
        let difference = law.combined(&[1.0 - ratio, highest - ratio * lowest])?;
        let half = (difference.high - difference.value) / at_lowest.value;
        let straight_chance = if voltages.len() > 2 { Some(curvature_chance(&kept)?) } else { None };
        Ok(Self {
            lines,
            out_of_line,
            at_zero_pa: pascal(law.coefficient(0)?),
            per_volt_pa: pascal(law.coefficient(1)?),
            straight_chance,
            reach_ratio: Interval { value: ratio, low: ratio - half, high: ratio + half },
            reach_n_per_m: [at_lowest.scaled(1e-3), law.combined(&[1.0, highest])?.scaled(1e-3)],
        })
    }
}

/// Force as displacement times a polynomial of the voltage.
fn law(readings: &[Reading], degree: i32) -> Result<Fit> {
    let rows: Vec<Vec<f64>> = readings
        .iter()
        .map(|reading| (0..=degree).map(|power| reading.displacement_mm * reading.voltage_v.powi(power)).collect())
        .collect();
    let forces: Vec<f64> = readings.iter().map(|reading| reading.force_un).collect();
    Fit::new(&rows, &forces).context("the voltage law")
}

/// Two-sided chance of the quadratic term.
fn curvature_chance(readings: &[Reading]) -> Result<f64> {
    use statrs::distribution::{ContinuousCDF, StudentsT};
    // In kV, so that the normal equations stay well conditioned.
    let scaled: Vec<Reading> = readings.iter().map(|r| Reading { voltage_v: 1e-3 * r.voltage_v, ..*r }).collect();
    let fit = law(&scaled, 2)?;
    let student = StudentsT::new(0.0, 1.0, fit.degrees_of_freedom as f64)?;
    Ok(2.0 * student.cdf(-fit.standard_errors_from(2, 0.0).abs()))
}

/// The report's spring taken as one piece.
#[cfg(test)]
pub(super) const WHOLE: Beam =
    Beam { length_m: 59.8e-3, width_m: 19.8e-3, thickness_m: 190e-6, youngs_modulus_pa: 1.0, density_kg_per_m3: 0.0 };

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: sum F x / sum x^2 with sum x^2 = 45.65.
    #[test]
    fn slopes_of_table_1() {
        let found = Experiment::new(&table1().unwrap(), &WHOLE).unwrap();
        for (line, expected) in found.lines.iter().zip([9350.1 / 45.65, 12579.9 / 45.65, 14725.3 / 45.65]) {
            assert!((line.all_un_per_mm.value - expected).abs() < 1e-9, "{line:?} {expected}");
        }
        assert_eq!(found.out_of_line.len(), 1);
        let reading = found.out_of_line[0].reading;
        assert_eq!((reading.voltage_v, reading.displacement_mm, reading.force_un), (0.0, 1.7, 331.0));
        assert!((found.lines[0].un_per_mm.value - 8787.4 / 42.76).abs() < 1e-9);
        assert!(found.reach_ratio.contains(1.57) && found.reach_ratio.value < 1.7);
    }

    #[test]
    fn readings_made_from_a_law_give_it_back() {
        let readings: Vec<Reading> = [0.0, 300.0, 600.0]
            .into_iter()
            .flat_map(|voltage_v| {
                [1.0, 2.0, 3.0, 4.0].map(|displacement_mm| Reading {
                    voltage_v,
                    displacement_mm,
                    // With a little that cancels.
                    force_un: (200.0 + 0.2 * voltage_v) * displacement_mm
                        + if displacement_mm == 2.0 {
                            1e-3
                        } else if displacement_mm == 1.0 {
                            -2e-3
                        } else {
                            0.0
                        },
                })
            })
            .collect();
        let found = Experiment::new(&readings, &WHOLE).unwrap();
        let factor = 1e-3 * WHOLE.youngs_modulus_of(1.0);
        assert!((found.at_zero_pa.value / (200.0 * factor) - 1.0).abs() < 1e-6);
        assert!((found.per_volt_pa.value / (0.2 * factor) - 1.0).abs() < 1e-6);
        assert!((found.reach_ratio.value - 1.6).abs() < 1e-5);
    }

    #[test]
    fn a_bad_table_is_one_line_with_its_place() {
        for (text, expected) in [
            ("force_un_0v\n1\n", "t: no column `displacement_mm`"),
            ("displacement_mm\n1\n", "t: no column `force_un_<V>v`"),
            ("displacement_mm,force_un_0v\n1,x\n", "t, line 2, column force_un_0v: `x` is not a finite number"),
            ("displacement_mm,force_un_0v\nNaN,1\n", "t, line 2, column displacement_mm: `NaN`"),
        ] {
            let error = parse("t", text).unwrap_err();
            assert!(error.is::<BadInput>() && error.to_string().starts_with(expected), "{error}");
        }
        let one = parse("t", "displacement_mm,force_un_0v\n1,1\n2,2\n3,3\n").unwrap();
        assert!(Experiment::new(&one, &WHOLE).unwrap_err().is::<BadInput>());
    }
}
