//! The response drifts with time, counted from the first reading.
//!
//! | form | |
//! | --- | --- |
//! | straight | `y (1 + rate t)` |
//! | exponential | `y exp(rate t)` |
//! | added | `y + rate t full scale` |
//! | step | `y factor` from one reading on, `y` before |

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;
use crate::stats::thresholds::empirical::{LEAST_PART_OF_STEP, SHORTEST_RUN};
use crate::stats::thresholds::probability::NATS_WITHIN_INTERVAL;

pub(super) struct Drift;

const STRAIGHT: usize = 0;
const EXPONENTIAL: usize = 1;
const STEP: usize = 3;

/// Returns the row from which on a factor other than 1 reduces the squared error most, and the factor less 1; NaN rows do not count.
fn best_step(FitContext { data, residual, .. }: &FitContext) -> Option<Vec<f64>> {
    let least = LEAST_PART_OF_STEP.get();
    let (mut product, mut square) = (0.0, 0.0);
    let seen = data.reading.iter().zip(*residual).filter(|(_, left)| !left.is_nan());
    let all: f64 = seen.map(|(reading, _)| reading * reading).sum();
    let mut best: Option<(f64, f64, f64)> = None;
    let rows = residual.len();
    for row in (1..rows).rev() {
        if !residual[row].is_nan() {
            product += residual[row] * data.reading[row];
            square += data.reading[row] * data.reading[row];
        }
        let long = rows - row >= SHORTEST_RUN.count() && row >= SHORTEST_RUN.count();
        let both = (least * all..=(1.0 - least) * all).contains(&square);
        if long && both && square > 0.0 && best.is_none_or(|(gain, ..)| product * product / square > gain) {
            best = Some((product * product / square, row as f64, product / square));
        }
    }
    best.map(|(_, row, change)| vec![row, change])
}

impl Effect for Drift {
    fn cause(&self) -> &'static str {
        "drift"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    fn affects(&self, _: usize) -> Affects {
        Affects::Readings
    }

    fn description(&self) -> &'static str {
        "the response changes with time, not with the voltage"
    }

    fn isolating_experiment(&self) -> &'static str {
        "the same step again after a long time"
    }

    fn forms(&self) -> usize {
        4
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        if form == STEP {
            return vec![Coordinate::fixed(0.0, data.rows() as f64), Coordinate::new(-0.9, 2.0)];
        }
        let most = 2.0 / data.duration_s().max(1e-9);
        vec![Coordinate::new(-most, most)]
    }

    /// A step of one of several records is looked for in that record alone.
    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>> {
        if form == STEP {
            return best_step(context).into_iter().filter(|_| !context.data.is_joined()).collect();
        }
        let rate = 0.05 / context.data.duration_s().max(1e-9);
        vec![vec![-rate], vec![rate]]
    }

    fn ln_candidates(&self, form: usize, data: &Data) -> f64 {
        if form == STEP { (data.rows() as f64).max(1.0).ln() } else { 0.0 }
    }

    fn searched(&self, form: usize) -> bool {
        form == STEP
    }

    fn refine_searched(&self, _: usize, point: &mut [f64], context: &FitContext) {
        if let Some(best) = best_step(context) {
            point.copy_from_slice(&best);
        }
    }

    /// The row may move as long as that costs less than [`NATS_WITHIN_INTERVAL`] (95 %).
    fn searched_range(&self, form: usize, point: &[f64], context: &FitContext) -> Vec<(String, f64, f64)> {
        if form != STEP {
            return Vec::new();
        }
        let FitContext { data, residual, sigma } = context;
        let row = (point[0] as usize).min(data.rows() - 1);
        let change = |row: usize| point[1] * data.reading[row] / (1.0 + point[1]);
        // Cost of leaving a row without the factor, in nats; giving it to one costs the negative.
        let cost = |row: usize| (residual[row] * change(row) - 0.5 * change(row).powi(2)) / (sigma * sigma);
        let reach = |outwards: &mut dyn Iterator<Item = usize>, sign: f64| {
            let costs = outwards.scan(0.0, |sum, row| {
                *sum += sign * cost(row);
                Some((row, *sum))
            });
            costs.take(data.rows() / 10).filter(|(_, sum)| *sum < NATS_WITHIN_INTERVAL).last().map(|(row, _)| row)
        };
        let earliest = reach(&mut (0..row).rev(), -1.0).unwrap_or(row).saturating_sub(1);
        let latest = reach(&mut (row..data.rows()), 1.0).map_or(row, |row| row + 1);
        vec![("at_s".into(), data.time_s[earliest], data.time_s[latest.min(data.rows() - 1)])]
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        if form == STEP {
            let at_s = data.time_s[(point[0] as usize).min(data.rows() - 1)];
            return vec![
                Quantity::new("factor", Dimension::Ratio, 1.0 + point[1]),
                Quantity::new("at_s", Dimension::TimePoint, at_s),
            ];
        }
        vec![Quantity::new("per_s", Dimension::Rate, point[0])]
    }

    fn modify_readings(&self, form: usize, point: &[f64], data: &Data, readings: &mut [f64]) {
        if form == STEP {
            let row = (point[0] as usize).min(readings.len());
            readings[row..].iter_mut().for_each(|reading| *reading *= 1.0 + point[1]);
            return;
        }
        let start = data.time_s.first().copied().unwrap_or(0.0);
        for (reading, time) in readings.iter_mut().zip(&data.time_s) {
            let grown = point[0] * (time - start);
            match form {
                STRAIGHT => *reading *= 1.0 + grown,
                EXPONENTIAL => *reading *= grown.exp(),
                _ => *reading += grown * data.full_scale_v,
            }
        }
    }
}
