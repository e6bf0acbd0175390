//! A sensor is stuck and repeats its reading. The runs are found in the readings themselves ([`crate::record::held`]), not by a fit.

use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;

pub(super) struct StuckSensor;

impl Effect for StuckSensor {
    fn cause(&self) -> &'static str {
        "stuck-sensor"
    }

    fn location(&self) -> Location {
        Location::Reading
    }

    fn description(&self) -> &'static str {
        "one reading is repeated while the response changes"
    }

    fn isolating_experiment(&self) -> &'static str {
        "readings at constant voltage with a second sensor, or with the sensor's own test signal"
    }

    fn forms(&self) -> usize {
        0
    }

    fn coordinates(&self, _: usize, _: &Data) -> Vec<Coordinate> {
        Vec::new()
    }

    fn initial_points(&self, _: usize, _: &FitContext) -> Vec<Vec<f64>> {
        Vec::new()
    }

    fn quantities(&self, _: usize, _: &[f64], _: &Data) -> Vec<Quantity> {
        Vec::new()
    }
}
