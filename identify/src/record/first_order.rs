//! A quick first-order fit of a record, in the file's units: the size of its time constant, gain and zero, which tells whether
//! a nominal spring is far from the record.
//!
//! ```text
//! reading = zero + gain (share u + (1 - share) lag(tau; u)) + start exp(-t / tau)
//! ```
//!
//! For each time constant of a grid the other four parameters are linear: ordinary least squares.

use std::ops::RangeInclusive;

use nalgebra::{SMatrix, SVector};

use simulation::record::Record;

use crate::record::signal::{Lag, Piece};
use crate::stats::median::median;

/// A first-order spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FirstOrder {
    /// Time constant, in s.
    pub tau_s: f64,
    /// Change of the settled reading per V, in the reading's unit.
    pub gain: f64,
    /// Instantaneous part of a step.
    pub share: f64,
    /// Reading at 0 V, in the reading's unit.
    pub zero: f64,
    /// Sum of the squared errors over that of a constant, 0 to 1.
    pub unexplained: f64,
}

/// Ratio of neighbouring time constants of the grid.
const RATIO: f64 = 1.25;
/// Shortest and longest time constant, in median row spacings and in lengths of the record.
const SHORTEST: f64 = 0.5;
const LONGEST: f64 = 3.0;
/// Relative weight that keeps columns of the same shape apart.
const RIDGE: f64 = 1e-9;

/// The rows of a record with a reading, and the voltage as a signal between all rows.
pub(crate) struct Rows<'r> {
    record: &'r Record,
    linear: bool,
    even: bool,
    spacing_s: f64,
    length_s: f64,
}

impl<'r> Rows<'r> {
    /// Takes a record whose voltage is linear or held between rows, of a spring that responds to the voltage's magnitude if
    /// `even`.
    pub(crate) fn new(record: &'r Record, linear: bool, even: bool) -> Self {
        let mut gaps: Vec<f64> = record.rows.windows(2).map(|pair| pair[1].time_s - pair[0].time_s).collect();
        let length_s =
            record.rows.last().map_or(0.0, |last| last.time_s) - record.rows.first().map_or(0.0, |at| at.time_s);
        Self { record, linear, even, spacing_s: median(&mut gaps).unwrap_or(0.0), length_s }
    }

    /// Returns the shortest and the longest time constant that the record can show, in s.
    pub(super) fn range_s(&self) -> (f64, f64) {
        (SHORTEST * self.spacing_s, LONGEST * self.length_s)
    }

    /// Returns the spring with the smallest squared error over all time constants; `None` for a record without any change.
    pub(crate) fn best(&self) -> Option<FirstOrder> {
        let (shortest, longest) = self.range_s();
        let count = ((longest / shortest).ln() / RATIO.ln()).ceil().max(0.0) as i32;
        self.best_of(shortest, 0..=count)
    }

    /// Returns the same over the time constants of the grid around one, in s, at most `steps` away.
    pub(crate) fn best_near(&self, tau_s: f64, steps: i32) -> Option<FirstOrder> {
        self.best_of(tau_s, -steps..=steps)
    }

    fn best_of(&self, tau_s: f64, steps: RangeInclusive<i32>) -> Option<FirstOrder> {
        let fits = steps.filter_map(|step| self.at(tau_s * RATIO.powi(step)));
        fits.min_by(|a, b| a.unexplained.total_cmp(&b.unexplained))
    }

    /// Returns the best spring with a given time constant, in s.
    pub(crate) fn at(&self, tau_s: f64) -> Option<FirstOrder> {
        let volts = |v: f64| if self.even { v.abs() } else { v };
        let rows = &self.record.rows;
        let (start_s, first_v) = (rows.first()?.time_s, volts(rows.first()?.voltage_v));
        let middle = rows.iter().find_map(|row| row.measured)?;
        let scale_v = rows.iter().map(|row| row.voltage_v.abs()).fold(f64::MIN_POSITIVE, f64::max);
        let mut lag = Lag::at(tau_s, first_v / scale_v);
        let (mut normal, mut right) = (SMatrix::<f64, 4, 4>::zeros(), SVector::<f64, 4>::zeros());
        let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
        for (index, row) in rows.iter().enumerate() {
            let here = volts(row.voltage_v) / scale_v;
            if let Some(reading) = row.measured.map(|reading| reading - middle) {
                let column = SVector::from([1.0, here, lag.value(), (-(row.time_s - start_s) / tau_s).exp()]);
                normal += column * column.transpose();
                right += reading * column;
                (squares, sum, count) = (squares + reading * reading, sum + reading, count + 1.0);
            }
            if let Some(next) = rows.get(index + 1) {
                let to = if self.linear { volts(next.voltage_v) / scale_v } else { here };
                lag.pass(Piece { duration_s: next.time_s - row.time_s, from: here, to });
            }
        }
        let total = squares - sum * sum / count;
        let sizes = normal.diagonal().map(|square| if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 });
        let scaled = SMatrix::<f64, 4, 4>::from_fn(|i, j| {
            normal[(i, j)] * sizes[i] * sizes[j] + if i == j { RIDGE } else { 0.0 }
        });
        let found = scaled.cholesky()?.solve(&right.component_mul(&sizes)).component_mul(&sizes);
        let left = squares - 2.0 * found.dot(&right) + found.dot(&(normal * found));
        let settled = found[1] + found[2];
        let fit = FirstOrder {
            tau_s,
            gain: settled / scale_v,
            share: if settled == 0.0 { 0.0 } else { found[1] / settled },
            zero: middle + found[0],
            unexplained: (left / total).clamp(0.0, 1.0),
        };
        (total > 0.0 && fit.gain.is_finite()).then_some(fit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::record::Row;

    #[test]
    fn size_of_any_first_order_spring_is_found() {
        for (tau_s, gain, zero, spacing_s) in
            [(181.0, 0.6, 23.0, 2.0), (3e-6, -1e-3, 0.0, 1e-7), (4e4, 20.0, -273.15, 600.0)]
        {
            let mut lag = Lag::at(tau_s, 0.0);
            let row = |row: usize| {
                let voltage_v = [0.0, 80.0, 30.0, 100.0][row / 150];
                let reading = zero + gain * (0.2 * voltage_v + 0.8 * lag.value());
                lag.pass(Piece { duration_s: spacing_s, from: voltage_v, to: voltage_v });
                Row { line: row, time_s: 1e3 * spacing_s + spacing_s * row as f64, voltage_v, measured: Some(reading) }
            };
            let record = Record { name: String::new(), rows: (0..600).map(row).collect() };
            let found = Rows::new(&record, false, false).best().unwrap();
            assert!((found.tau_s / tau_s).ln().abs() < 0.12, "{found:?}");
            assert!((found.gain / gain - 1.0).abs() < 0.03 && (found.share - 0.2).abs() < 0.05, "{found:?}");
            assert!((found.zero - zero).abs() < 2.0 * gain.abs() && found.unexplained < 1e-3, "{found:?}");
        }
    }
}
