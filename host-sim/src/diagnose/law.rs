//! The static law: a plant file's, and what effects put behind it.

use model::extended::law::MOST_POINTS;

use crate::plant_file;

/// Laws one behind the other.
#[derive(Default)]
pub struct Law<'a> {
    table: Option<&'a plant_file::Law>,
    behind: Vec<Box<dyn Fn(f64) -> f64 + 'a>>,
}

/// A chord that departs from its curve by less, as a part of the full scale, is the curve.
const STRAIGHT: f64 = 1e-7;

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

    /// For a plant file: at the points of the file's own, and at more up to `full_scale_v` where it bends most.
    pub fn table(&self, full_scale_v: f64) -> Option<plant_file::Law> {
        if self.behind.is_empty() {
            return self.table.cloned();
        }
        let mut voltage_v = self.table.map_or_else(|| vec![0.0, full_scale_v], |table| table.voltage_v.clone());
        let chord =
            |a: f64, b: f64, part: f64| self.at(a + part * (b - a)) - self.at(a) - part * (self.at(b) - self.at(a));
        let bend =
            |a: f64, b: f64| [0.25, 0.5, 0.75].map(|part| chord(a, b, part).abs()).into_iter().fold(0.0, f64::max);
        if voltage_v[voltage_v.len() - 1] < full_scale_v && voltage_v.len() < MOST_POINTS {
            voltage_v.push(full_scale_v);
        }
        while voltage_v.len() < MOST_POINTS {
            let bends = voltage_v.windows(2).map(|pair| bend(pair[0], pair[1])).enumerate();
            let Some((at, most)) = bends.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            if most < STRAIGHT * full_scale_v {
                break;
            }
            voltage_v.insert(at + 1, (voltage_v[at] + voltage_v[at + 1]) / 2.0);
        }
        // A chord is off on one side of its bow: half of that to either side.
        let bows: Vec<f64> = voltage_v.windows(2).map(|pair| chord(pair[0], pair[1], 0.5)).collect();
        let mut stiffness: Vec<f64> = voltage_v.iter().map(|&voltage| self.at(voltage)).collect();
        for (point, value) in stiffness.iter_mut().enumerate().skip(1) {
            let after = bows.get(point).copied().unwrap_or(bows[point - 1]);
            *value += (bows[point - 1] + after) / 4.0;
        }
        Some(plant_file::Law { voltage_v, stiffness })
    }
}

/// Straight between points and beyond them.
fn straight(x: &[f64], y: &[f64], at: f64) -> f64 {
    let upper = x.partition_point(|&point| point <= at).clamp(1, x.len() - 1);
    let slope = (y[upper] - y[upper - 1]) / (x[upper] - x[upper - 1]);
    y[upper - 1] + slope * (at - x[upper - 1])
}
