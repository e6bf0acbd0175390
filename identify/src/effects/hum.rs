//! A periodic disturbance is added to the readings.
//!
//! | form | disturbance |
//! | --- | --- |
//! | sine | `a cos(2 pi f t) + b sin(2 pi f t)` |
//! | in proportion | `y (a cos(2 pi f t) + b sin(2 pi f t))`: the response is modulated, by a load or a supply |
//! | with harmonics | `sum_k a_k cos(2 pi k f t) + b_k sin(2 pi k f t)`, `k` 1 to 3: no sine, as of a load that is switched |

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;
use crate::record::spectrum::{self, Peak};
use crate::stats::scale::centred;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{FEWEST_PERIODS, LINE_TO_NEIGHBOURS};

pub(super) struct Hum;

/// Number of spectral peaks that are tried.
const PEAKS: usize = 3;
const SINE: usize = 0;
const IN_PROPORTION: usize = 1;
const WITH_HARMONICS: usize = 2;
/// Number of sines of the form with harmonics.
const HARMONICS: usize = 3;

/// Frequencies that are tried on each side of a line, and their distance, in periods per record.
const LINE_STEPS: i32 = 5;
const LINE_STEP: f64 = 0.1;

/// Multiples of a frequency of the voltage that the response to it has.
const MULTIPLES: [f64; 3] = [1.0, 2.0, 3.0];
/// Part of the voltage's mean square in a sine from which the voltage is one. Half a period more or less in the record leaves 0.4 of it.
const PART_OF_SINE: f64 = 0.25;

/// Returns true if a frequency is one at which the voltage, less its mean, drives the spring, or a multiple of it: no record can tell a
/// disturbance from the response there.
fn is_driven(frequency_hz: f64, voltage: &[f64], data: &Data) -> bool {
    MULTIPLES.iter().any(|multiple| {
        let line = spectrum::line(voltage, data, frequency_hz / multiple);
        0.5 * (line.cosine.powi(2) + line.sine.powi(2)) * data.rows() as f64 > PART_OF_SINE * dot(voltage, voltage)
    })
}

/// Returns the number of sines of a form.
fn sines(form: usize) -> usize {
    if form == WITH_HARMONICS { HARMONICS } else { 1 }
}

/// Returns the sine near a frequency whose multiples explain most of a residual: the phases of the multiples tell the frequency better
/// than the spectrum does.
fn likeliest(form: usize, frequency_hz: f64, residual: &[f64], data: &Data) -> Peak {
    let step_hz = LINE_STEP / data.duration_s();
    let near = (-LINE_STEPS..=LINE_STEPS).map(|step| frequency_hz + f64::from(step) * step_hz);
    let power = |frequency_hz: f64| -> f64 {
        let lines = (1..=sines(form)).map(|k| spectrum::line(residual, data, k as f64 * frequency_hz));
        lines.map(|line| line.cosine.powi(2) + line.sine.powi(2)).sum()
    };
    let best = near.max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(frequency_hz);
    spectrum::line(residual, data, best)
}

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

    fn forms(&self) -> usize {
        3
    }

    fn common_forms(&self) -> usize {
        1
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let most = if form == IN_PROPORTION { 1.0 } else { 2.0 * data.full_scale_v.max(1.0) };
        let frequency = Coordinate::new(0.9 * FEWEST_PERIODS.get() / data.duration_s().max(1e-9), 0.5 / data.sample_s);
        let mut coordinates = vec![frequency];
        coordinates.resize(1 + 2 * sines(form), Coordinate::new(-most, most));
        coordinates
    }

    fn initial_points(&self, form: usize, FitContext { data, residual, .. }: &FitContext) -> Vec<Vec<f64>> {
        let level_v = data.reading.iter().map(|reading| reading.abs()).sum::<f64>() / data.rows() as f64;
        let scale = if form == IN_PROPORTION { 1.0 / level_v.max(f64::MIN_POSITIVE) } else { 1.0 };
        // What is synchronous with the schedule is no disturbance: the forms other than a sine need a line that stands out.
        let stands_out = || {
            let line = spectrum::most_prominent_line(residual, data)?;
            (line.prominence > LINE_TO_NEIGHBOURS.get()).then(|| likeliest(form, line.frequency_hz, residual, data))
        };
        let peaks =
            if form == SINE { spectrum::peaks(residual, data, PEAKS) } else { stands_out().into_iter().collect() };
        let start = |peak: Peak| {
            let further = (2..=sines(form)).map(|k| spectrum::line(residual, data, k as f64 * peak.frequency_hz));
            let each = std::iter::once(peak).chain(further).flat_map(|it| [scale * it.cosine, scale * it.sine]);
            std::iter::once(peak.frequency_hz).chain(each).collect()
        };
        let voltage = centred(&data.voltage_v);
        peaks
            .into_iter()
            .filter(|peak| peak.frequency_hz > FEWEST_PERIODS.get() / data.duration_s())
            .filter(|peak| !is_driven(peak.frequency_hz, &voltage, data))
            .map(start)
            .collect()
    }

    /// The amplitude of a disturbance in proportion to the response is that at the largest voltage.
    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        let scale = if form == IN_PROPORTION { data.full_scale_v } else { 1.0 };
        let power: f64 = point[1..].iter().map(|amplitude| amplitude * amplitude).sum();
        vec![
            Quantity::new("amplitude", Dimension::ReadingSize, scale * power.sqrt()),
            Quantity::new("freq_hz", Dimension::Frequency, point[0]),
        ]
    }

    fn ln_candidates(&self, _: usize, data: &Data) -> f64 {
        // There are half as many independent frequencies as rows; 4.5 nats are paid with the three coordinates.
        ((data.rows() as f64 / 2.0).max(1.0).ln() - 4.5).max(0.0)
    }

    fn modify_readings(&self, form: usize, point: &[f64], data: &Data, readings: &mut [f64]) {
        for (reading, (sin, cos)) in readings.iter_mut().zip(spectrum::oscillation(point[0], data)) {
            let mut turned = (1.0, 0.0);
            let mut sum = 0.0;
            for amplitudes in point[1..].chunks_exact(2) {
                turned = (turned.0 * cos - turned.1 * sin, turned.1 * cos + turned.0 * sin);
                sum += amplitudes[0] * turned.0 + amplitudes[1] * turned.1;
            }
            *reading += if form == IN_PROPORTION { *reading * sum } else { sum };
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::record::input::Input;
    use simulation::record::{Record, Row};

    /// A line of 3 V is at `line_hz` in the residual, the voltage a sine of 5 Hz.
    #[test]
    fn a_line_at_a_multiple_of_the_voltages_frequency_is_no_disturbance() {
        let tried = |line_hz: f64| {
            let sine = |row: usize, frequency_hz: f64| (TAU * frequency_hz * 0.005 * row as f64).sin();
            let row = |row| Row {
                line: 0,
                time_s: 0.005 * row as f64,
                voltage_v: 50.0 + 40.0 * sine(row, 5.0),
                measured: Some(0.0),
            };
            let data = Data::new(&Record { name: String::new(), rows: (0..2000).map(row).collect() }, Input::Hold);
            let residual: Vec<f64> = (0..2000).map(|row| 3.0 * sine(row, line_hz)).collect();
            let points = Hum.initial_points(SINE, &FitContext { data: &data, residual: &residual, sigma: 0.1 });
            points.iter().any(|point| (point[0] - line_hz).abs() < 0.05)
        };
        assert!([5.0, 10.0, 15.0].iter().all(|&hz| !tried(hz)) && [3.0, 7.3, 50.0].iter().all(|&hz| tried(hz)));
    }
}
