//! The whole response grows or fades with time, counted from the first reading.
//!
//! | form | |
//! | --- | --- |
//! | straight | `y (1 + rate t)` |
//! | exponential | `y exp(rate t)` |
//! | added | `y + rate t full scale` |

use crate::diagnose::data::Data;
use crate::diagnose::effect::{Acts, Coordinate, Effect, Quantity, Scene, Stage};

pub(super) struct Drift;

const STRAIGHT: usize = 0;
const EXPONENTIAL: usize = 1;

impl Effect for Drift {
    fn cause(&self) -> &'static str {
        "drift"
    }

    fn stage(&self) -> Stage {
        Stage::Relaxation
    }

    fn acts(&self) -> Acts {
        Acts::OnReadings
    }

    fn meaning(&self) -> &'static str {
        "the response changes with the clock, not with the voltage"
    }

    fn experiment(&self) -> &'static str {
        "the same step again after a long time"
    }

    fn forms(&self) -> usize {
        3
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        let most = 2.0 / data.duration_s().max(1e-9);
        vec![Coordinate::new(-most, most)]
    }

    fn starts(&self, _: usize, Scene { data, .. }: &Scene) -> Vec<Vec<f64>> {
        let rate = 0.05 / data.duration_s().max(1e-9);
        vec![vec![-rate], vec![rate]]
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("per_s", "1/s", point[0])]
    }

    fn read(&self, form: usize, point: &[f64], data: &Data, readings: &mut [f64]) {
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
