//! The static law from voltage to settled stiffness: the table of a plant file, and laws that effects apply after it.

use model::extended::law::MAX_POINTS;

use crate::plant::knots::{Point, knots};
use simulation::plant_file;

/// A composition of static laws, the first of which may be a table.
#[derive(Default)]
pub struct Law<'a> {
    table: Option<&'a plant_file::Law>,
    behind: Vec<Box<dyn Fn(f64) -> f64 + 'a>>,
}

/// Largest error of a chord, as a fraction of the full scale, that counts as none.
const STRAIGHT_TOLERANCE: f64 = 1e-7;
/// Number of intervals of the full scale at which a law is evaluated for its table.
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
        let first = self.table.map_or(voltage, |table| straight(&table.voltage_v, &table.stiffness, voltage));
        self.behind.iter().fold(first, |value, law| law(value))
    }

    /// Returns the table for a plant file, of this law multiplied by `gain` and followed by the law `behind`, up to
    /// `full_scale_v` or the end of the file's own table; `None` for the identity.
    pub fn table(&self, gain: f64, behind: &Law, full_scale_v: f64) -> Option<plant_file::Law> {
        if self.behind.is_empty() && gain == 1.0 && behind.is_identity() {
            return self.table.cloned();
        }
        let mut voltage_v: Vec<f64> = (0..=STEPS).map(|step| full_scale_v * step as f64 / STEPS as f64).collect();
        voltage_v.extend(self.table.iter().flat_map(|table| &table.voltage_v));
        voltage_v.sort_by(f64::total_cmp);
        voltage_v.dedup_by(|b, a| *b - *a < 1e-3 * full_scale_v / STEPS as f64);
        let curve: Vec<Point> =
            voltage_v.into_iter().map(|voltage| (voltage, behind.at(gain * self.at(voltage)))).collect();
        let (voltage_v, stiffness) = knots(&curve, MAX_POINTS, STRAIGHT_TOLERANCE * full_scale_v).into_iter().unzip();
        Some(plant_file::Law { voltage_v, stiffness })
    }
}

/// Returns the linear interpolation or extrapolation of the points `x`, `y` at `at`.
fn straight(x: &[f64], y: &[f64], at: f64) -> f64 {
    let upper = x.partition_point(|&point| point <= at).clamp(1, x.len() - 1);
    let slope = (y[upper] - y[upper - 1]) / (x[upper] - x[upper - 1]);
    y[upper - 1] + slope * (at - x[upper - 1])
}
