//! The beam experiment (section 2.5, Table 1): force on the free end by its displacement, at several voltages.
//!
//! For each voltage a line through the origin is fitted, all with one common scatter, and outliers are removed one by
//! one. Then
//!
//! ```text
//! F = (a + c V) x,   E(V) = (a + c V) L^3 / (3 I)
//! ```
//!
//! is fitted to all remaining readings together. The report instead fits a line through three Young's moduli, which
//! leaves its interval a single degree of freedom.

use anyhow::Result;
use serde::Serialize;

use crate::beam::cantilever::Beam;
use crate::beam::readings::{Reading, table1};
use crate::beam::regression::{self, Fit, Interval, chance_beyond};
use simulation::bad_input;
use simulation::bad_input::BadInput;

/// The report's spring as one uniform beam (section 2.5); its Young's modulus is a result of the experiment.
pub const SPRING: Beam =
    Beam { length_m: 59.8e-3, width_m: 19.8e-3, thickness_m: 190e-6, youngs_modulus_pa: 1.0, density_kg_per_m3: 0.0 };

/// The results of a beam experiment; all intervals are 95 % intervals.
#[derive(Clone, Debug, Serialize)]
pub struct Experiment {
    /// One line per voltage, in ascending order.
    pub lines: Vec<Line>,
    /// Outliers that were removed, the most significant first.
    pub out_of_line: Vec<OutOfLine>,
    /// Young's modulus of the whole beam at 0 V, in Pa.
    pub at_zero_pa: Interval,
    /// Increase of Young's modulus with the voltage, in Pa/V.
    pub per_volt_pa: Interval,
    /// p-value of the quadratic term of E(V): the probability of so large a curvature if E(V) is linear; `None` without
    /// a test.
    pub straight_chance: Option<f64>,
    /// Ratio of the stiffness at the highest voltage to that at 0 V.
    pub reach_ratio: Interval,
    /// Spring constants at the lowest and the highest voltage, in N/m.
    pub reach_n_per_m: [Interval; 2],
}

/// The line of one voltage.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// Voltage across the spring, in V.
    pub voltage_v: f64,
    /// Spring constant from all readings, in uN/mm (1 uN/mm = 1 mN/m).
    pub all_un_per_mm: Interval,
    /// Spring constant without the outliers, in uN/mm.
    pub un_per_mm: Interval,
    /// Young's modulus of the whole beam from `un_per_mm`, in Pa.
    pub youngs_modulus_pa: Interval,
}

/// A reading that is an outlier of its experiment.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct OutOfLine {
    /// The reading itself.
    pub reading: Reading,
    /// Prediction of the other readings, in uN, with its 95 % prediction interval.
    pub expected_un: Interval,
    /// Probability of so large a deviation if the reading has the scatter of the others.
    pub chance: f64,
}

/// Fits lines through the origin, one per voltage, with one scatter for all.
///
/// # Errors
/// If there are no more readings than voltages.
pub fn lines(readings: &[Reading], voltages: &[f64]) -> Result<Fit> {
    let row = |reading: &Reading| {
        voltages.iter().map(|&v| if v == reading.voltage_v { reading.displacement_mm } else { 0.0 }).collect()
    };
    let forces: Vec<f64> = readings.iter().map(|reading| reading.force_un).collect();
    Fit::new(&readings.iter().map(row).collect::<Vec<_>>(), &forces)
}

/// Removes outliers one by one; returns the remaining readings, the lines through them, and the outliers.
///
/// # Errors
/// [`BadInput`] if there are too few readings.
pub fn in_line(readings: &[Reading], voltages: &[f64]) -> Result<(Vec<Reading>, Fit, Vec<OutOfLine>)> {
    let (mut kept, mut set_aside) = (readings.to_vec(), Vec::new());
    loop {
        let fit = determined(lines(&kept, voltages))?;
        let Some(index) = fit.out_of_line() else { return Ok((kept, fit, set_aside)) };
        let regression::Reading { expected, chance } = fit.readings[index];
        set_aside.push(OutOfLine { reading: kept.remove(index), expected_un: expected, chance });
    }
}

/// The voltages of a table in V, ascending, each once.
pub fn voltages(readings: &[Reading]) -> Vec<f64> {
    let mut voltages: Vec<f64> = readings.iter().map(|reading| reading.voltage_v).collect();
    voltages.sort_by(f64::total_cmp);
    voltages.dedup();
    voltages
}

impl Experiment {
    /// The results of the report's Table 1 on its spring.
    ///
    /// # Errors
    /// If the built-in data file is damaged.
    pub fn paper() -> Result<Self> {
        Self::new(&table1()?, &SPRING)
    }

    /// Young's modulus of the whole beam, in Pa, at a voltage in V, by the fitted line.
    pub fn youngs_modulus_pa(&self, voltage_v: f64) -> f64 {
        self.at_zero_pa.value + self.per_volt_pa.value * voltage_v
    }

    /// Evaluates readings of a beam with the dimensions of `beam`, whose Young's modulus is ignored.
    ///
    /// # Errors
    /// [`BadInput`] for fewer than two voltages or too few readings.
    pub fn new(readings: &[Reading], beam: &Beam) -> Result<Self> {
        let voltages = voltages(readings);
        let &[lowest, .., highest] = &voltages[..] else {
            bad_input!("the beam experiment has {} voltage(s); expected at least two", voltages.len())
        };
        let all = determined(lines(readings, &voltages))?;
        let (kept, fit, out_of_line) = in_line(readings, &voltages)?;
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
        // To first order: the interval of the difference between the numerator and the ratio times the denominator.
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

/// Fits the force as the displacement times a polynomial of the voltage.
fn law(readings: &[Reading], degree: i32) -> Result<Fit> {
    let rows: Vec<Vec<f64>> = readings
        .iter()
        .map(|reading| (0..=degree).map(|power| reading.displacement_mm * reading.voltage_v.powi(power)).collect())
        .collect();
    let forces: Vec<f64> = readings.iter().map(|reading| reading.force_un).collect();
    determined(Fit::new(&rows, &forces))
}

/// Turns the error of a fit that the readings do not determine into one of bad input.
fn determined(fit: Result<Fit>) -> Result<Fit> {
    let expected = "expected displacements other than 0 at each voltage, three readings or more";
    fit.map_err(|error| BadInput(format!("the beam experiment: {error}; {expected}")).into())
}

/// Two-sided p-value of the quadratic term of the voltage.
fn curvature_chance(readings: &[Reading]) -> Result<f64> {
    // Voltages in kV keep the normal equations well conditioned.
    let scaled: Vec<Reading> = readings.iter().map(|r| Reading { voltage_v: 1e-3 * r.voltage_v, ..*r }).collect();
    let fit = law(&scaled, 2)?;
    chance_beyond(fit.standard_errors_from(2, 0.0), fit.degrees_of_freedom)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beam::readings::parse;

    /// Computed by hand: sum F x / sum x^2 with sum x^2 = 45.65.
    #[test]
    fn slopes_of_table_1_agree_with_hand_computation() {
        let found = Experiment::paper().unwrap();
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
    fn readings_simulated_from_a_law_recover_it() {
        let readings: Vec<Reading> = [0.0, 300.0, 600.0]
            .into_iter()
            .flat_map(|voltage_v| {
                [1.0, 2.0, 3.0, 4.0].map(|displacement_mm| Reading {
                    voltage_v,
                    displacement_mm,
                    // A small scatter that cancels out.
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
        let found = Experiment::new(&readings, &SPRING).unwrap();
        let factor = 1e-3 * SPRING.youngs_modulus_of(1.0);
        assert!((found.at_zero_pa.value / (200.0 * factor) - 1.0).abs() < 1e-6);
        assert!((found.per_volt_pa.value / (0.2 * factor) - 1.0).abs() < 1e-6);
        assert!((found.reach_ratio.value - 1.6).abs() < 1e-5);
    }

    #[test]
    fn too_few_readings_are_bad_input() {
        let parse = |text: &str| Experiment::new(&parse("t", text).unwrap(), &SPRING);
        for text in [
            "displacement_mm,force_un_0v\n1,1\n2,2\n3,3\n",
            "displacement_mm,force_un_0v,force_un_9v\n1,1,2\n",
            "displacement_mm,force_un_0v,force_un_9v\n1e300,1,2\n2,4,5\n3,7,7\n",
        ] {
            assert!(parse(text).unwrap_err().is::<BadInput>(), "{text}");
        }
    }

    /// Readings without scatter, and the only reading of a voltage, are no outliers.
    #[test]
    fn readings_without_scatter_are_no_outliers() {
        for text in [
            "displacement_mm,force_un_0v,force_un_9v\n1,100,150\n2,200,300\n3,300,450\n",
            "displacement_mm,force_un_0v,force_un_9v,force_un_12v\n1,100,150,160\n2,200,300,320\n3,300,450,480\n",
            "displacement_mm,force_un_0v,force_un_9v\n0,0,0\n2,410,560\n",
            "displacement_mm,force_un_0v,force_un_9v\n1,0,0\n2,0,0\n3,0,0\n",
        ] {
            let found = Experiment::new(&parse("t", text).unwrap(), &SPRING).unwrap();
            assert!(found.out_of_line.is_empty(), "{text}: {found:?}");
            assert!(found.straight_chance.is_none_or(|chance| (0.0..=1.0).contains(&chance)), "{found:?}");
        }
    }
}
