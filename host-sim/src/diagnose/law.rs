//! The static law: a plant file's, and what effects put behind it.

use model::extended::law::MAX_POINTS;

use super::knots::{Point, knots};
use crate::plant_file;

/// Laws one behind the other.
#[derive(Default)]
pub struct Law<'a> {
    table: Option<&'a plant_file::Law>,
    behind: Vec<Box<dyn Fn(f64) -> f64 + 'a>>,
}

/// A chord that departs from its curve by less, as a part of the full scale, is the curve.
const STRAIGHT: f64 = 1e-7;
/// Parts of the full scale at which a curve is looked at.
const STEPS: usize = 1000;

impl<'a> Law<'a> {
    /// Of a plant file; none is the straight line.
    pub fn of(table: Option<&'a plant_file::Law>) -> Self {
        Self { table, behind: Vec::new() }
    }

    /// Puts a law behind the others.
    pub fn push(&mut self, law: impl Fn(f64) -> f64 + 'a) {
        self.behind.push(Box::new(law));
    }

    /// True if it is the straight line.
    pub fn is_none(&self) -> bool {
        self.table.is_none() && self.behind.is_empty()
    }

    /// What it makes of a voltage.
    pub fn at(&self, voltage: f64) -> f64 {
        let first = self.table.map_or(voltage, |table| straight(&table.voltage_v, &table.stiffness, voltage));
        self.behind.iter().fold(first, |value, law| law(value))
    }

    /// For a plant file, `gain` times it and another law behind: through knots up to `full_scale_v` or as far as the file's own
    /// law goes.
    pub fn table(&self, gain: f64, behind: &Law, full_scale_v: f64) -> Option<plant_file::Law> {
        if self.behind.is_empty() && gain == 1.0 && behind.is_none() {
            return self.table.cloned();
        }
        let mut voltage_v: Vec<f64> = (0..=STEPS).map(|step| full_scale_v * step as f64 / STEPS as f64).collect();
        voltage_v.extend(self.table.iter().flat_map(|table| &table.voltage_v));
        voltage_v.sort_by(f64::total_cmp);
        voltage_v.dedup_by(|b, a| *b - *a < 1e-3 * full_scale_v / STEPS as f64);
        let curve: Vec<Point> =
            voltage_v.into_iter().map(|voltage| (voltage, behind.at(gain * self.at(voltage)))).collect();
        let (voltage_v, stiffness) = knots(&curve, MAX_POINTS, STRAIGHT * full_scale_v).into_iter().unzip();
        Some(plant_file::Law { voltage_v, stiffness })
    }
}

/// Straight between points and beyond them.
fn straight(x: &[f64], y: &[f64], at: f64) -> f64 {
    let upper = x.partition_point(|&point| point <= at).clamp(1, x.len() - 1);
    let slope = (y[upper] - y[upper - 1]) / (x[upper] - x[upper - 1]);
    y[upper - 1] + slope * (at - x[upper - 1])
}
