//! Readings saturate at a bound.
//!
//! | form | |
//! | --- | --- |
//! | upper, lower | `reading = min(y, limit)`, `max(y, limit)` |
//! | upper and lower with a knee | `reading = y - knee ln(1 + exp((y - limit) / knee))`, and its mirror image: a transition of about 4 knees |
//!
//! Where several readings are exactly the extreme, the bound is known and [`crate::record::observed`] treats those rows
//! as censored. These forms are for a bound in front of the noise.

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::knee::at_most;
use crate::record::data::Data;

pub(super) struct SensorSaturation;

const UPPER: usize = 0;
const UPPER_WITH_KNEE: usize = 2;
/// Bounds of a knee, relative to the range of the readings, and those that are tried.
const SMALLEST_KNEE: f64 = 0.003;
const LARGEST_KNEE: f64 = 0.15;
const KNEES: [f64; 2] = [0.015, 0.05];
/// Largest distance of a bound with a knee beyond the farthest reading, relative to the range: readings only approach it.
const BEYOND: f64 = 0.1;

fn is_upper(form: usize) -> bool {
    matches!(form, UPPER | UPPER_WITH_KNEE)
}

fn has_knee(form: usize) -> bool {
    form >= UPPER_WITH_KNEE
}

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
        4
    }

    fn common_forms(&self) -> usize {
        2
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let (lowest, highest) = extremes(data);
        let range = (highest - lowest).max(f64::MIN_POSITIVE);
        let beyond = if has_knee(form) { BEYOND * range } else { 0.0 };
        let limit = if is_upper(form) {
            Coordinate::new(lowest, highest + beyond)
        } else {
            Coordinate::new(lowest - beyond, highest)
        };
        let knee = Coordinate::log(SMALLEST_KNEE * range, LARGEST_KNEE * range);
        if has_knee(form) { vec![limit, knee] } else { vec![limit] }
    }

    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        let (lowest, highest) = extremes(data);
        [0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.45, 0.6]
            .into_iter()
            .flat_map(|part| {
                let depth = part * (highest - lowest);
                let limit = if is_upper(form) { highest - depth } else { lowest + depth };
                let with = KNEES.map(|knee| vec![limit, (knee * (highest - lowest)).ln()]);
                if has_knee(form) { with.to_vec() } else { vec![vec![limit]] }
            })
            .collect()
    }

    fn quantities(&self, form: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        let knee = has_knee(form).then(|| Quantity::new("knee", Dimension::ReadingDifference, point[1].exp()));
        [Quantity::new("limit", Dimension::Reading, point[0])].into_iter().chain(knee).collect()
    }

    fn ln_candidates(&self, _: usize, _: &Data) -> f64 {
        10f64.ln()
    }

    fn modify_readings(&self, form: usize, point: &[f64], _: &Data, readings: &mut [f64]) {
        let (limit, knee) = (point[0], if has_knee(form) { point[1].exp() } else { 0.0 });
        for reading in readings {
            *reading = if is_upper(form) { at_most(*reading, limit, knee) } else { -at_most(-*reading, -limit, knee) };
        }
    }
}

fn extremes(data: &Data) -> (f64, f64) {
    data.reading.iter().fold((f64::MAX, f64::MIN), |(low, high), &reading| (low.min(reading), high.max(reading)))
}
