//! The static law from voltage to settled stiffness: the table of a plant file, and laws that effects apply after it.

use model::extended::law::MAX_POINTS;

use crate::plant::knots::{Point, knots};
use crate::plant::visited::{Range, Visited};
use crate::record::scales::REFERENCE_VOLTAGE_V;
use simulation::plant_file;

/// A composition of static laws, the first of which may be a table.
#[derive(Default)]
pub struct Law<'a> {
    table: Option<&'a plant_file::Law>,
    behind: Vec<Box<dyn Fn(f64) -> f64 + 'a>>,
}

/// Largest error of a chord, as a fraction of the range's end, that counts as none.
const STRAIGHT_TOLERANCE: f64 = 1e-7;
/// Largest number of points up to the lower end of the range.
const MOST_BELOW: usize = 3;
/// Number of intervals of the range at which a law is evaluated for its table.
const STEPS: usize = 1000;

impl<'a> Law<'a> {
    /// Returns the law of a plant file; without a table it is the identity.
    pub fn of(table: Option<&'a plant_file::Law>) -> Self {
        Self { table, behind: Vec::new() }
    }

    /// Appends a law, which is applied to the result of the others.
    pub fn push(&mut self, law: impl Fn(f64) -> f64 + 'a) {
        self.behind.push(Box::new(law));
    }

    /// Returns true if the law is the identity.
    pub fn is_identity(&self) -> bool {
        self.table.is_none() && self.behind.is_empty()
    }

    /// Returns the settled stiffness at a voltage, both in V.
    pub fn at(&self, voltage: f64) -> f64 {
        self.behind.iter().fold(self.first(voltage), |value, law| law(value))
    }

    /// Returns the file's own table at a voltage, both in V.
    fn first(&self, voltage: f64) -> f64 {
        self.table.map_or(voltage, |table| straight(&table.voltage_v, &table.stiffness, voltage))
    }

    /// Returns the range of voltages over which a record shows this law followed by a law behind the relaxation, which it shows over the
    /// relaxed stiffness only. `settled` is the stiffness at which the relaxation settles for a result of this law, both in V.
    pub fn known(&self, settled: impl Fn(f64) -> f64, visited: &Visited) -> Range {
        let Range { low, high } = visited.law;
        let mut voltages = (1..=STEPS).rev().map(|step| high * step as f64 / STEPS as f64);
        let reached = voltages.find(|voltage| settled(self.at(*voltage)).abs() <= visited.stiffness.high);
        Range { low, high: reached.unwrap_or(high) }
    }

    /// Returns the table for a plant file, of this law multiplied by `gain` and followed by the law `behind`; `None` for the identity.
    ///
    /// It is taken in the range that is `known`. Above, the law that follows the file's own table continues with its end slope; below, it
    /// is straight to 0 V, where every table begins.
    pub fn table(&self, gain: f64, behind: &Law, known: Range) -> Option<plant_file::Law> {
        if self.behind.is_empty() && gain == 1.0 && behind.is_identity() {
            return self.table.cloned();
        }
        let first = |voltage: f64| self.first(voltage);
        let inner = |first: f64| gain * self.behind.iter().fold(first, |value, law| law(value));
        let Range { low, high } = known;
        let high = if high > 0.0 { high } else { REFERENCE_VOLTAGE_V };
        let step = high / STEPS as f64;
        // Straight beyond the range as a function of the file's own table, which is known there.
        let [start, before_end, end] = [low, high - step, high].map(|voltage| {
            let first = first(voltage);
            (first, behind.at(inner(first)))
        });
        let value = |voltage: f64| match first(voltage) {
            first if voltage < low && start.0 != 0.0 => start.1 * first / start.0,
            first if voltage > high && end.0 != before_end.0 => {
                end.1 + (end.1 - before_end.1) / (end.0 - before_end.0) * (first - end.0)
            }
            first => behind.at(inner(first)),
        };
        let mut voltage_v: Vec<f64> =
            (0..=STEPS).map(|of| step * of as f64).filter(|voltage| *voltage == 0.0 || *voltage > low).collect();
        voltage_v.extend(self.table.iter().flat_map(|table| &table.voltage_v));
        voltage_v.push(low);
        voltage_v.sort_by(f64::total_cmp);
        voltage_v.dedup_by(|b, a| *b - *a < 1e-3 * step);
        let curve: Vec<Point> = voltage_v.into_iter().map(|voltage| (voltage, value(voltage))).collect();
        // The range's lower end is a point of its own, so that no line crosses it.
        let (below, within) = curve.split_at(curve.partition_point(|(voltage, _)| *voltage < low));
        let tolerance = STRAIGHT_TOLERANCE * high;
        let mut points = Vec::new();
        if let (Some(first), false) = (within.first(), below.is_empty()) {
            points = knots(&[below, &[*first]].concat(), MOST_BELOW, tolerance);
            points.pop();
        }
        points.extend(knots(within, MAX_POINTS - points.len(), tolerance));
        let (voltage_v, stiffness) = points.into_iter().unzip();
        Some(plant_file::Law { voltage_v, stiffness })
    }
}

/// Returns the linear interpolation or extrapolation of the points `x`, `y` at `at`.
fn straight(x: &[f64], y: &[f64], at: f64) -> f64 {
    let upper = x.partition_point(|&point| point <= at).clamp(1, x.len() - 1);
    let slope = (y[upper] - y[upper - 1]) / (x[upper] - x[upper - 1]);
    y[upper - 1] + slope * (at - x[upper - 1])
}
