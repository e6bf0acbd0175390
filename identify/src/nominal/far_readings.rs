//! Readings that no spring made: each alone, or with one neighbour, far from those around it, and independent of the voltage.
//!
//! One such reading is enough to add a delay, a quick time constant or an oscillation to the best model, which least squares let
//! follow it, and to widen all intervals. So they are left out before a model is chosen.

use simulation::record::Record;

use crate::nominal::identified::Course;
use crate::record::changes::{changes, follow};
use crate::stats::median::{median, robust_deviation};
use crate::stats::scale::largest_magnitude;
use crate::stats::thresholds::empirical::ROWS_AFTER_CHANGE;

/// A reading is far off if it deviates from those around it by more than this number of scales of all such deviations.
const FAR: f64 = 10.0;
/// A far reading is alone if those next to it deviate by fewer scales than this.
const NEAR: f64 = 4.0;
/// Most readings in succession that are far off for the same reason.
const LONGEST_RUN: usize = 2;
/// An error is compared with the median of so many before and after it.
const AROUND: usize = 3;
/// A reading at the start is compared with the straight line through so many that follow the longest run.
const LINE: usize = 8;
/// If more of the readings are far off, they are a part of the response.
const MOST: f64 = 0.05;
/// A change of the voltage is a jump if its ratio to the usual one is larger.
const JUMP: f64 = 10.0;
/// Records with fewer readings have no scale of their own.
const FEWEST: usize = 20;

/// Returns the readings at the start of a record that are far off while the voltage does not change yet. A free response would
/// follow them, so that they do not show in the errors of any model.
pub(super) fn at_start(record: &Record) -> Vec<usize> {
    let (voltage, reading): (Vec<f64>, Vec<f64>) =
        record.rows.iter().filter_map(|row| Some((row.voltage_v, row.measured?))).unzip();
    let constant = voltage.iter().take_while(|volts| **volts == voltage[0]).count();
    if constant < LONGEST_RUN + LINE || reading.len() < FEWEST {
        return Vec::new();
    }
    let apart: Vec<f64> = reading.windows(LONGEST_RUN + LINE).map(from_line).collect();
    alone(&apart).into_iter().filter(|row| *row < LONGEST_RUN).collect()
}

/// Returns the distance of the first of some readings from the straight line through the last [`LINE`] of them.
fn from_line(readings: &[f64]) -> f64 {
    let line = &readings[LONGEST_RUN..];
    let middle = (LINE - 1) as f64 / 2.0;
    let mean = line.iter().sum::<f64>() / LINE as f64;
    let (mut rise, mut run) = (0.0, 0.0);
    for (row, reading) in line.iter().enumerate() {
        rise += (row as f64 - middle) * (reading - mean);
        run += (row as f64 - middle).powi(2);
    }
    (readings[0] - mean + (middle + LONGEST_RUN as f64) * rise / run).abs()
}

/// Returns the readings whose errors are far off; none if these are many or follow changes of the voltage.
pub(super) fn of_errors(course: &Course, delay: f64) -> Vec<usize> {
    let rows = course.residual.len();
    if rows < FEWEST {
        return Vec::new();
    }
    let apart: Vec<f64> = (0..rows).map(|row| (course.residual[row] - around(&course.residual, row)).abs()).collect();
    // Where no model follows the readings, one that is far from its neighbours alone is of no importance.
    let usual = robust_deviation(course.residual.iter().copied()).unwrap_or(0.0);
    let far: Vec<usize> = alone(&apart).into_iter().filter(|&row| apart[row] > FAR * usual).collect();
    if far.is_empty() || far.len() as f64 > MOST * rows as f64 {
        return Vec::new();
    }
    let after = after_changes(course, delay);
    let just_after = far.iter().filter(|row| after[**row]).count();
    if follow(far.len(), just_after, &after) { Vec::new() } else { far }
}

/// Returns for each reading whether the voltage has just jumped: by far more than it usually changes from row to row.
pub(super) fn after_changes(course: &Course, delay: f64) -> Vec<bool> {
    let (time, voltage) = (&course.time_s, &course.voltage_v);
    let full_scale = largest_magnitude(voltage);
    let mut usual: Vec<f64> = voltage.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let least = JUMP * median(&mut usual).unwrap_or(0.0);
    let mut after = vec![false; time.len()];
    for (row, _) in changes(voltage, full_scale).filter(|(_, change)| *change > least) {
        let last = time.partition_point(|at| *at <= time[row] + delay) + ROWS_AFTER_CHANGE.count();
        after[row..last.min(time.len())].fill(true);
    }
    after
}

/// Returns the readings whose distance from those around them is large while that of their neighbours is not.
fn alone(apart: &[f64]) -> Vec<usize> {
    // Equal readings of a coarse sensor are no scale.
    let Some(scale) = robust_deviation(apart.iter().copied().filter(|apart| *apart != 0.0)) else { return Vec::new() };
    let is_far = |row: usize| apart[row] > FAR * scale;
    let is_near = |row: usize| apart.get(row).is_none_or(|apart| *apart < NEAR * scale);
    let mut far = Vec::new();
    let mut row = 0;
    while row < apart.len() {
        let run = (row..apart.len()).take_while(|&row| is_far(row)).count();
        let alone = run <= LONGEST_RUN && (row == 0 || is_near(row - 1)) && is_near(row + run);
        if alone {
            far.extend(row..row + run);
        }
        row += run.max(1);
    }
    far
}

/// Returns the median of the errors next to one, of as many at the ends of the record.
fn around(values: &[f64], row: usize) -> f64 {
    let first = row.saturating_sub(AROUND).min(values.len() - 2 * AROUND - 1);
    let mut others: Vec<f64> =
        (first..=first + 2 * AROUND).filter(|other| *other != row).map(|other| values[other]).collect();
    median(&mut others).expect("errors around it")
}
