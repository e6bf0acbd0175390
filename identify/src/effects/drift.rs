//! The response drifts with time, counted from the first reading.
//!
//! | form | |
//! | --- | --- |
//! | straight | `y (1 + rate t)` |
//! | exponential | `y exp(rate t)` |
//! | added | `y + rate t full scale` |

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;

pub(super) struct Drift;

const STRAIGHT: usize = 0;
const EXPONENTIAL: usize = 1;

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
        3
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        let most = 2.0 / data.duration_s().max(1e-9);
        vec![Coordinate::new(-most, most)]
    }

    fn initial_points(&self, _: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        let rate = 0.05 / data.duration_s().max(1e-9);
        vec![vec![-rate], vec![rate]]
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("per_s", Dimension::Rate, point[0])]
    }

    fn modify_readings(&self, form: usize, point: &[f64], data: &Data, readings: &mut [f64]) {
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
