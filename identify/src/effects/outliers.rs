//! Single readings are outliers. This is a property of the noise and not of the chain: a mixture of two scales instead
//! of one heavy tail ([`crate::noise`]).

use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;

pub(super) struct Outliers;

impl Effect for Outliers {
    fn cause(&self) -> &'static str {
        "outliers"
    }

    fn location(&self) -> Location {
        Location::Reading
    }

    fn description(&self) -> &'static str {
        "single readings are far off"
    }

    fn isolating_experiment(&self) -> &'static str {
        "readings at constant voltage: outliers come without any change"
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
