//! A periodic disturbance is added to the readings: `a cos(2 pi f t) + b sin(2 pi f t)`.

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;
use crate::record::spectrum;
use crate::stats::thresholds::empirical::FEWEST_PERIODS;

pub(super) struct Hum;

/// Number of spectral peaks that are tried.
const PEAKS: usize = 3;

impl Effect for Hum {
    fn cause(&self) -> &'static str {
        "hum"
    }

    fn location(&self) -> Location {
        Location::Reading
    }

    fn affects(&self, _: usize) -> Affects {
        Affects::Readings
    }

    fn description(&self) -> &'static str {
        "a periodic disturbance is added to the readings"
    }

    fn isolating_experiment(&self) -> &'static str {
        "readings at constant voltage, at another sample time: a line that is an alias moves"
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        let most = 2.0 * data.full_scale_v.max(1.0);
        let frequency = Coordinate::new(0.9 * FEWEST_PERIODS.get() / data.duration_s().max(1e-9), 0.5 / data.sample_s);
        vec![frequency, Coordinate::new(-most, most), Coordinate::new(-most, most)]
    }

    fn initial_points(&self, _: usize, FitContext { data, residual, .. }: &FitContext) -> Vec<Vec<f64>> {
        spectrum::peaks(residual, data, PEAKS)
            .into_iter()
            .filter(|peak| peak.frequency_hz > FEWEST_PERIODS.get() / data.duration_s())
            .map(|peak| vec![peak.frequency_hz, peak.cosine, peak.sine])
            .collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![
            Quantity::new("amplitude", Dimension::ReadingSize, point[1].hypot(point[2])),
            Quantity::new("freq_hz", Dimension::Frequency, point[0]),
        ]
    }

    fn ln_candidates(&self, _: usize, data: &Data) -> f64 {
        // There are half as many independent frequencies as rows; 4.5 nats are paid with the three coordinates.
        ((data.rows() as f64 / 2.0).max(1.0).ln() - 4.5).max(0.0)
    }

    fn modify_readings(&self, _: usize, point: &[f64], data: &Data, readings: &mut [f64]) {
        for (reading, (sin, cos)) in readings.iter_mut().zip(spectrum::oscillation(point[0], data)) {
            *reading += point[1] * cos + point[2] * sin;
        }
    }
}
