//! The static law: a sensitivity that depends on the voltage, without memory.
//!
//! Important terms:
//!
//! - *point*: a voltage and the law's value there, both in V. The first point is (0, 0).
//! - *line*: the straight line from one point to the next. The first and the last line continue beyond the points.
//!
//! ```text
//! f = value_i + slope_i (p - start_i),    i: the last point at or below p
//! ```
//!
//! Exact but for the rounding of values (2^-21 V) and slopes (2^-28 of the distance to the point).

use crate::coefficient::{Weight, WideGain, saturated, sum};
use crate::error::OutOfRange;
use crate::units::{SampleTime, Signal, signal};
use crate::validated::{Validate, Validated};

/// Largest number of points of a law, (0, 0) included.
pub const MAX_POINTS: usize = 9;

/// Smallest slope of a line that can be inverted.
const MIN_SLOPE: f64 = 0.01;

/// A static law through up to nine points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law<'a> {
    /// 2 to 9 voltages, from 0 V upwards, at least 1 mV apart, up to 1000 V.
    pub voltage_v: &'a [f64],
    /// Value of the law at each voltage, in V, within +-2000 V; the first is 0. The slope between two points is within
    /// +-10.
    pub stiffness: &'a [f64],
}

impl Validate for Law<'_> {
    fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        let count = self.voltage_v.len();
        OutOfRange::check_count("law.voltage_v", count, 2..=MAX_POINTS, "points")?;
        OutOfRange::check_count("law.stiffness", self.stiffness.len(), count..=count, "values, one per voltage")?;
        let mut last = None;
        for (&voltage, &value) in self.voltage_v.iter().zip(self.stiffness) {
            let (allowed_v, unit, from, reach) = match last {
                None => (0.0..=0.0, "V, where the law starts", 0.0, 0.0),
                Some((start, from)) => (start + 1e-3..=1000.0, "V, upwards", from, Weight::MAX * (voltage - start)),
            };
            OutOfRange::check("law.voltage_v", voltage, allowed_v, unit)?;
            let (lowest, highest) = (f64::max(from - reach, -2000.0), f64::min(from + reach, 2000.0));
            OutOfRange::check("law.stiffness", value, lowest..=highest, "V")?;
            last = Some((voltage, value));
        }
        Ok(())
    }
}

impl Law<'_> {
    /// Checks that every line rises.
    ///
    /// # Errors
    /// [`OutOfRange`] names `law.stiffness` at the first point to which the law does not rise.
    pub(super) fn check_inverse(&self) -> Result<(), OutOfRange> {
        for (volts, values) in self.voltage_v.windows(2).zip(self.stiffness.windows(2)) {
            if let ([from_v, to_v], [from, to]) = (volts, values) {
                let lowest = from + MIN_SLOPE * (to_v - from_v);
                OutOfRange::check("law.stiffness", *to, lowest..=2000.0, "V, for the spring to be invertible")?;
            }
        }
        Ok(())
    }

    /// Returns the slope of the steepest line, at least 0.
    pub(super) fn largest_slope(&self) -> f64 {
        self.slopes().fold(0.0, f64::max)
    }

    /// Returns the slope of the flattest line.
    pub(super) fn smallest_slope(&self) -> f64 {
        self.slopes().fold(f64::INFINITY, f64::min)
    }

    fn slopes(&self) -> impl Iterator<Item = f64> {
        self.voltage_v.windows(2).zip(self.stiffness.windows(2)).map(|(v, f)| slope(v, f))
    }
}

fn slope(voltages: &[f64], values: &[f64]) -> f64 {
    match (voltages, values) {
        ([from_v, to_v], [from, to]) => (to - from) / (to_v - from_v),
        _ => 0.0,
    }
}

/// The law, quantized for the tick; unused places repeat the last line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Config {
    lines: [Line; MAX_POINTS - 1],
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Line {
    start: Signal,
    value: Signal,
    slope: Weight,
}

impl Validated<'_, Law<'_>> {
    /// Quantizes the law for the tick.
    pub(crate) fn quantize(self) -> Config {
        let law = self.settings();
        let mut lines = [Line::default(); MAX_POINTS - 1];
        let mut line = Line::default();
        let mut points = law.voltage_v.iter().zip(law.stiffness).zip(law.slopes());
        for place in &mut lines {
            if let Some(((&start, &value), slope)) = points.next() {
                line = Line { start: signal(start), value: signal(value), slope: Weight::new(slope) };
            }
            *place = line;
        }
        Config { lines }
    }
}

impl Config {
    /// Returns the law's value at `input`, saturated to a signal's range.
    #[inline(always)]
    pub(crate) fn at(&self, input: Signal) -> Signal {
        let mut line = &self.lines[0];
        for next in &self.lines[1..] {
            if input >= next.start {
                line = next;
            }
        }
        // Cannot wrap: either the line starts at 0 V, or the input lies beyond its positive start.
        let distance = input - line.start;
        saturated(sum(line.value) + line.slope.times(distance))
    }
}

/// Inverse of a law whose lines all rise: the reciprocal slope of each line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Inverse {
    per_slope: [WideGain; MAX_POINTS - 1],
}

impl Inverse {
    /// Quantizes the inverse of a law that [`Law::check_inverse`] accepts.
    pub(crate) fn new(law: &Law<'_>) -> Self {
        let mut inverse = Self::default();
        let (mut per_slope, mut slopes) = (WideGain::default(), law.slopes());
        for place in &mut inverse.per_slope {
            if let Some(slope) = slopes.next() {
                per_slope = WideGain::new(1.0 / slope);
            }
            *place = per_slope;
        }
        inverse
    }

    /// Returns the input at which `law` has this value.
    #[inline(always)]
    pub(crate) fn at(&self, law: &Config, value: Signal) -> Signal {
        let [first, lines @ ..] = &law.lines;
        let [per_slope, others @ ..] = &self.per_slope;
        let (mut line, mut per_slope) = (first, per_slope);
        for (next, other) in lines.iter().zip(others) {
            if value >= next.value {
                (line, per_slope) = (next, other);
            }
        }
        line.start.saturating_add(per_slope.times(value.saturating_sub(line.value)))
    }
}

#[cfg(test)]
mod tests;
