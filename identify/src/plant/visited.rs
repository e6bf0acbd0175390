//! Where on its curves a spring has been in a record: a law is known there only.
//!
//! Ranges are of magnitudes, in V: a law is the same for both signs of the voltage.

use crate::record::signal::Signal;

/// Distance from a range, relative to its upper end, at which a curve counts as known.
const NEAR: f64 = 0.02;

/// Smallest and largest magnitude of a signal, in V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest magnitude, in V; 0 if the signal changes its sign.
    pub low: f64,
    /// Largest magnitude, in V.
    pub high: f64,
}

impl Range {
    /// Returns the range of a signal, with its value before the first piece.
    pub fn of(signal: &Signal) -> Self {
        let (mut least, mut most) = (signal.before, signal.before);
        signal.clone().pass(|piece| {
            least = least.min(piece.from).min(piece.to);
            most = most.max(piece.from).max(piece.to);
            (piece.from, piece.to)
        });
        let low = if least <= 0.0 && most >= 0.0 { 0.0 } else { least.abs().min(most.abs()) };
        Self { low, high: least.abs().max(most.abs()) }
    }

    /// Returns the smallest range that contains both.
    pub fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Returns true if a magnitude is in the range or near it.
    pub fn is_near(self, magnitude: f64) -> bool {
        let slack = NEAR * self.high;
        (self.low - slack..=self.high + slack).contains(&magnitude)
    }
}

/// Axis of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Voltage on the spring's electrodes.
    Voltage,
    /// Input of the static law: that voltage after the hysteresis.
    Law,
    /// The relaxed stiffness.
    Stiffness,
}

/// Range of each axis in a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visited {
    /// Range of the voltage on the electrodes.
    pub voltage: Range,
    /// Range of the static law's input.
    pub law: Range,
    /// Range of the relaxed stiffness, before a law behind the relaxation.
    pub stiffness: Range,
}

impl Visited {
    /// Returns the range of an axis.
    pub fn of(&self, axis: Axis) -> Range {
        match axis {
            Axis::Voltage => self.voltage,
            Axis::Law => self.law,
            Axis::Stiffness => self.stiffness,
        }
    }

    /// Returns the smallest ranges that contain both.
    pub fn with(self, other: Self) -> Self {
        Self {
            voltage: self.voltage.with(other.voltage),
            law: self.law.with(other.law),
            stiffness: self.stiffness.with(other.stiffness),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::record::{Record, Row};
    use simulation::schedule::{Between, Schedule};

    fn range(voltages: &[f64], before: f64) -> Range {
        let row = |(row, &voltage_v): (usize, &f64)| Row { line: 0, time_s: row as f64, voltage_v, measured: None };
        let record = Record { name: String::new(), rows: voltages.iter().enumerate().map(row).collect() };
        let times: Vec<f64> = (0..voltages.len()).map(|row| row as f64).collect();
        Range::of(&Signal::new(&Schedule::from_record(&record, Between::Hold), &times, before))
    }

    #[test]
    fn range_is_of_magnitudes_and_includes_the_value_before_the_record() {
        assert_eq!(range(&[200.0, 500.0, 300.0], 200.0), Range { low: 200.0, high: 500.0 });
        assert_eq!(range(&[200.0, 500.0], 0.0), Range { low: 0.0, high: 500.0 });
        assert_eq!(range(&[-200.0, -500.0], -200.0), Range { low: 200.0, high: 500.0 });
        assert_eq!(range(&[-600.0, 500.0], -600.0), Range { low: 0.0, high: 600.0 });
        let known = Range { low: 200.0, high: 500.0 };
        assert_eq!([189.0, 191.0, 509.0, 511.0].map(|at| known.is_near(at)), [false, true, true, false]);
    }
}
