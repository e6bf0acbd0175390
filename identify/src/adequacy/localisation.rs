//! Where an error is largest: the stretch of time, and the voltages, whose mean square exceeds the record's most.
//!
//! ```text
//! max over stretches of sum(e^2 - mean(e^2))        (Bentley, Communications of the ACM 27, 1984: Kadane's algorithm)
//! ```

use std::ops::Range;

use crate::dimension::Dimension;
use crate::record::data::Data;
use crate::record::scales::Scales;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::POWER_TO_NAME_VOLTAGES;

/// A stretch of time and a range of voltages where an error is largest.
pub(crate) struct Localisation<'d> {
    scales: &'d Scales,
    /// First and last time, in normalised s.
    time_s: [f64; 2],
    /// Decimals that distinguish the times of two rows in the user's unit.
    decimals: usize,
    /// Fractions of the error's power and of the rows within the stretch of time.
    in_time: Density,
    /// First and last absolute voltage, in normalised V, with the fractions of power and rows there; `None` if time localises better.
    at_voltages: Option<([f64; 2], Density)>,
}

/// Fractions of the power and of the rows, 0 to 1.
#[derive(Clone, Copy)]
struct Density {
    power: f64,
    rows: f64,
}

impl Density {
    fn power_per_row(self) -> f64 {
        self.power / self.rows
    }
}

impl<'d> Localisation<'d> {
    /// Localises errors, in V or in any other unit, one for each row of the record.
    pub(crate) fn new(data: &'d Data, errors: &[f64]) -> Self {
        let power = dot(errors, errors).max(f64::MIN_POSITIVE);
        let density = |power, rows: usize| Density { power, rows: rows as f64 / errors.len() as f64 };
        let each_row: Vec<(f64, usize)> = errors.iter().map(|error| (error * error / power, 1)).collect();
        let (run, share, rows) = densest(&each_row);
        let in_time = density(share, rows);
        let time_s = [run.start, run.end - 1].map(|row| data.time_s[row]);

        let mut by_voltage: Vec<(f64, f64)> =
            data.voltage_v.iter().zip(&each_row).map(|(voltage, (square, _))| (voltage.abs(), *square)).collect();
        by_voltage.sort_by(|a, b| a.0.total_cmp(&b.0));
        let levels: Vec<&[(f64, f64)]> = by_voltage.chunk_by(|a, b| a.0 == b.0).collect();
        let each_level: Vec<(f64, usize)> =
            levels.iter().map(|level| (level.iter().map(|row| row.1).sum(), level.len())).collect();
        let (run, share, rows) = densest(&each_level);
        let there = density(share, rows);
        let denser = there.power > POWER_TO_NAME_VOLTAGES.get() && there.power_per_row() > in_time.power_per_row();
        let voltages_v = [run.start, run.end - 1].map(|level| levels[level][0].0);
        let scales = data.scales();
        let sample =
            scales.restored(Dimension::Time, data.sample_s) / Dimension::Time.size_of_shown_unit(&scales.units);
        Self {
            scales,
            time_s,
            decimals: (-(1.001 * sample).log10().floor()).clamp(0.0, 9.0) as usize,
            in_time,
            at_voltages: denser.then_some((voltages_v, there)),
        }
    }

    /// The words that follow a description of the error in a report.
    pub(crate) fn words(&self) -> String {
        let unit = Dimension::TimePoint.size_of_shown_unit(&self.scales.units);
        let [from, to] = self.time_s.map(|time_s| {
            let time = self.scales.restored(Dimension::TimePoint, time_s) / unit;
            format!("{time:.*} {}", self.decimals, self.scales.unit(Dimension::TimePoint))
        });
        let [percent, of_rows] = [self.in_time.power, self.in_time.rows].map(|part| 100.0 * part);
        let mut words = format!(", {percent:.0} % of it from {from} to {to}, in {of_rows:.0} % of the readings");
        if let Some(([low, high], there)) = self.at_voltages {
            let [low, high] = [low, high].map(|voltage| self.scales.shown(Dimension::Voltage, voltage, 0));
            let range = if low == high { low } else { format!("voltages from {low} to {high}") };
            words += &format!(", and {:.0} % at {range}", 100.0 * there.power);
        }
        words
    }
}

/// Finds the run of neighbours, each given as its fraction of the power and its rows, that maximises power less the run's
/// fraction of the rows; returns the run, its power and its rows.
fn densest(parts: &[(f64, usize)]) -> (Range<usize>, f64, usize) {
    let rows: usize = parts.iter().map(|part| part.1).sum();
    let (mut best, mut best_sum) = (0..1, f64::NEG_INFINITY);
    let (mut from, mut sum) = (0, 0.0);
    for (place, &(power, count)) in parts.iter().enumerate() {
        if sum < 0.0 {
            (from, sum) = (place, 0.0);
        }
        sum += power - count as f64 / rows as f64;
        if sum > best_sum {
            (best, best_sum) = (from..place + 1, sum);
        }
    }
    let inside = &parts[best.clone()];
    (best, inside.iter().map(|part| part.0).sum(), inside.iter().map(|part| part.1).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::input::Input;
    use simulation::record::{Record, Row};

    #[test]
    fn a_burst_is_localised_in_time_and_by_its_voltage() {
        // Levels of 100 rows, 0.1 s apart; each occurs twice.
        let volts = |row: usize| 100.0 * (row / 100 % 5) as f64;
        let row = |row: usize| Row { line: row, time_s: 0.1 * row as f64, voltage_v: volts(row), measured: Some(0.0) };
        let record = Record { name: String::new(), rows: (0..1000).map(row).collect() };
        let data = Data::new(&record, Input::Hold);
        let words = |large: &dyn Fn(usize) -> bool| {
            let errors: Vec<f64> = (0..1000).map(|row| if large(row) { 9.0 } else { 1.0 }).collect();
            Localisation::new(&data, &errors).words()
        };
        assert_eq!(
            words(&|row| (420..450).contains(&row)),
            ", 71 % of it from 42.0 s to 44.9 s, in 3 % of the readings"
        );
        let at_300 = words(&|row| volts(row) == 300.0);
        assert!(at_300.ends_with(", and 95 % at 300 V"), "{at_300}");
    }
}
