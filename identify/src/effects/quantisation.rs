//! Readings are coarsely quantised. The step is found in the readings themselves ([`crate::record::observed`]), not by
//! a fit.

use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;

pub(super) struct Quantisation;

impl Effect for Quantisation {
    fn cause(&self) -> &'static str {
        "quantisation"
    }

    fn location(&self) -> Location {
        Location::Reading
    }

    fn description(&self) -> &'static str {
        "readings come in coarse steps"
    }

    fn isolating_experiment(&self) -> &'static str {
        "readings at constant voltage with the sensor on a finer range"
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
