//! Readings saturate at a bound: `reading = min(y, limit)`, or `max` at a lower bound.
//!
//! Where several readings are exactly the extreme, the bound is known and [`crate::record::observed`] treats those rows
//! as censored. These forms are for a bound in front of the noise.

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;

pub(super) struct SensorSaturation;

const UPPER: usize = 0;

impl Effect for SensorSaturation {
    fn cause(&self) -> &'static str {
        "sensor-saturation"
    }

    fn location(&self) -> Location {
        Location::Reading
    }

    fn affects(&self, _: usize) -> Affects {
        Affects::Readings
    }

    fn description(&self) -> &'static str {
        "readings stop at a bound"
    }

    fn isolating_experiment(&self) -> &'static str {
        "a slow stair beyond the bound, with the sensor on another range"
    }

    fn forms(&self) -> usize {
        2
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        let (lowest, highest) = extremes(data);
        vec![Coordinate::new(lowest, highest)]
    }

    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        let (lowest, highest) = extremes(data);
        [0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.45, 0.6]
            .map(|part| {
                let depth = part * (highest - lowest);
                vec![if form == UPPER { highest - depth } else { lowest + depth }]
            })
            .to_vec()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("limit", Dimension::Reading, point[0])]
    }

    fn ln_candidates(&self, _: usize, _: &Data) -> f64 {
        10f64.ln()
    }

    fn modify_readings(&self, form: usize, point: &[f64], _: &Data, readings: &mut [f64]) {
        for reading in readings {
            *reading = if form == UPPER { reading.min(point[0]) } else { reading.max(point[0]) };
        }
    }
}

fn extremes(data: &Data) -> (f64, f64) {
    data.reading.iter().fold((f64::MAX, f64::MIN), |(low, high), &reading| (low.min(reading), high.max(reading)))
}
