//! Causes that are found in the readings themselves or in their noise, not by a fit: they have a description, and no form.

use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;

pub(super) struct OfTheReadings {
    cause: &'static str,
    description: &'static str,
    isolating_experiment: &'static str,
}

/// Readings are coarsely quantised: [`crate::record::observed`] finds the step.
pub(super) static QUANTISATION: OfTheReadings = OfTheReadings {
    cause: "quantisation",
    description: "readings come in coarse steps",
    isolating_experiment: "readings at constant voltage with the sensor on a finer range",
};

/// A sensor is stuck and repeats its reading: [`crate::record::held`] finds the runs.
pub(super) static STUCK_SENSOR: OfTheReadings = OfTheReadings {
    cause: "stuck-sensor",
    description: "one reading is repeated while the response changes",
    isolating_experiment: "readings at constant voltage with a second sensor, or with the sensor's own test signal",
};

/// Single readings are outliers: the noise is a mixture of two scales instead of one heavy tail ([`crate::noise`]).
pub(super) static OUTLIERS: OfTheReadings = OfTheReadings {
    cause: "outliers",
    description: "single readings are far off",
    isolating_experiment: "readings at constant voltage: outliers come without any change",
};

impl Effect for OfTheReadings {
    fn cause(&self) -> &'static str {
        self.cause
    }

    fn location(&self) -> Location {
        Location::Reading
    }

    fn description(&self) -> &'static str {
        self.description
    }

    fn isolating_experiment(&self) -> &'static str {
        self.isolating_experiment
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
