//! A periodic disturbance is added to the readings.
//!
//! | form | disturbance |
//! | --- | --- |
//! | sine | `a cos(2 pi f t) + b sin(2 pi f t)` |
//! | in proportion | `y (a cos(2 pi f t) + b sin(2 pi f t))`: the response is modulated, by a load or a supply |
//! | with harmonics | `sum_k a_k cos(2 pi k f t) + b_k sin(2 pi k f t)`, `k` 1 to 3: no sine, as of a load that is switched |
//! | varying | `a(t) cos(2 pi f t) + b(t) sin(2 pi f t)`: its amplitude or phase changes ([`hum_envelope`]) |
//! | stretch | a sine from one reading to another: what causes it is switched on and off |
//! | by the response | `a(y) cos(2 pi f t) + b(y) sin(2 pi f t)`, both parabolas: the ripple of a converter |

use std::ops::{Range, RangeInclusive};

use crate::dimension::Dimension;
use crate::effects::boundary;
use crate::effects::drive::Drive;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::effects::hum_envelope::{self, KNOTS, POWERS, over_response, over_time};
use crate::record::data::Data;
use crate::record::spectrum::{self, Peak};
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{FEWEST_PERIODS, LINE_TO_NEIGHBOURS};

pub(super) struct Hum;

/// Number of spectral peaks that are tried.
const PEAKS: usize = 3;
const SINE: usize = 0;
const IN_PROPORTION: usize = 1;
const WITH_HARMONICS: usize = 2;
const VARYING: usize = 3;
const STRETCH: usize = 4;
const BY_RESPONSE: usize = 5;
/// Number of sines of the form with harmonics.
const HARMONICS: usize = 3;

/// Frequencies that are tried on each side of a line, and their distance, in periods per record.
const LINE_STEPS: i32 = 5;
const LINE_STEP: f64 = 0.1;
/// Frequencies that are tried on each side of the line of an amplitude that changes, one period per record from each other.
const SIDE_LINES: i32 = KNOTS as i32 / 2;
/// Fewest periods from one knot of a varying amplitude to the next: with fewer it would follow what is not periodic.
const PERIODS_PER_KNOT: f64 = 2.0;

/// Returns the number of sines of a form.
fn sines(form: usize) -> usize {
    if form == WITH_HARMONICS { HARMONICS } else { 1 }
}

/// Returns the point of a sine in the stretch of a residual that it explains most of; `None` if that is the whole record.
fn in_stretch(frequency_hz: f64, residual: &[f64], data: &Data) -> Option<Vec<f64>> {
    let found = hum_envelope::stretch(residual, data, frequency_hz)?;
    let [cosine, sine] = found.amplitudes;
    Some(vec![frequency_hz, cosine, sine, found.rows.start as f64, found.rows.end as f64])
}

/// Returns the rows of a point of the form in a stretch.
fn rows_of(point: &[f64], rows: usize) -> Range<usize> {
    let end = (point[4] as usize).min(rows);
    (point[3] as usize).min(end)..end
}

/// Returns the number of cosine and sine amplitudes of a form.
fn pairs(form: usize) -> usize {
    match form {
        VARYING => KNOTS,
        BY_RESPONSE => POWERS,
        _ => sines(form),
    }
}

/// Returns the point of a form whose amplitudes are not constant, near a frequency, that explains most of a residual; `None` if the rows
/// do not determine it. A disturbance whose amplitude changes sign has its lines beside its frequency.
fn with_envelope(form: usize, frequency_hz: f64, residual: &[f64], data: &Data) -> Option<Vec<f64>> {
    let near = (-SIDE_LINES..=SIDE_LINES).map(|line| frequency_hz + f64::from(line) / data.duration_s());
    let fits = near.filter(|frequency_hz| *frequency_hz > 0.0).filter_map(|frequency_hz| {
        let (gain, amplitudes) = match form {
            VARYING => hum_envelope::fitted(residual, data, frequency_hz, KNOTS, over_time(data)),
            _ => hum_envelope::fitted(residual, data, frequency_hz, POWERS, over_response(data)),
        }?;
        Some((gain, std::iter::once(frequency_hz).chain(amplitudes).collect()))
    });
    fits.max_by(|(one, _), (other, _)| one.total_cmp(other)).map(|(_, point)| point)
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
        6
    }

    fn common_forms(&self) -> usize {
        1
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let most = if form == IN_PROPORTION { 1.0 } else { 2.0 * data.full_scale_v.max(1.0) };
        let frequency = Coordinate::new(0.9 * FEWEST_PERIODS.get() / data.duration_s().max(1e-9), 0.5 / data.sample_s);
        // The amplitudes of a varying one hold every change of its phase.
        let mut coordinates = vec![Coordinate { fitted: form != VARYING, ..frequency }];
        coordinates.resize(1 + 2 * pairs(form), Coordinate::new(-most, most));
        if form == STRETCH {
            coordinates.extend([Coordinate::fixed(0.0, data.rows() as f64); 2]);
        }
        coordinates
    }

    /// A disturbance that changes is looked for in a single record.
    fn initial_points(&self, form: usize, FitContext { data, residual, .. }: &FitContext) -> Vec<Vec<f64>> {
        let changes = matches!(form, VARYING | STRETCH);
        if changes && data.is_joined() {
            return Vec::new();
        }
        let level_v = data.reading.iter().map(|reading| reading.abs()).sum::<f64>() / data.rows() as f64;
        let scale = if form == IN_PROPORTION { 1.0 / level_v.max(f64::MIN_POSITIVE) } else { 1.0 };
        // What is synchronous with the schedule is no disturbance: the forms other than a sine need a line that stands out.
        let stands_out = || {
            let own = if changes { KNOTS } else { spectrum::OF_A_SINE };
            let line = spectrum::most_prominent_line(residual, data, own)?;
            (line.prominence > LINE_TO_NEIGHBOURS.get()).then(|| likeliest(form, line.frequency_hz, residual, data))
        };
        let peaks =
            if form == SINE { spectrum::peaks(residual, data, PEAKS) } else { stands_out().into_iter().collect() };
        let constant = |peak: Peak| {
            let further = (2..=sines(form)).map(|k| spectrum::line(residual, data, k as f64 * peak.frequency_hz));
            let each = std::iter::once(peak).chain(further).flat_map(|it| [scale * it.cosine, scale * it.sine]);
            std::iter::once(peak.frequency_hz).chain(each).collect()
        };
        let start = |peak: Peak| match form {
            VARYING | BY_RESPONSE => with_envelope(form, peak.frequency_hz, residual, data),
            STRETCH => in_stretch(peak.frequency_hz, residual, data),
            _ => Some(constant(peak)),
        };
        let drive = Drive::of(data);
        let fewest = if form == VARYING { PERIODS_PER_KNOT * KNOTS as f64 } else { 0.0 };
        peaks
            .into_iter()
            .filter(|peak| peak.frequency_hz > fewest.max(FEWEST_PERIODS.get()) / data.duration_s())
            .filter(|peak| !drive.reaches(peak.frequency_hz))
            .filter_map(start)
            .collect()
    }

    /// The amplitude of a disturbance in proportion to the response is that at the largest voltage; of one that changes otherwise, the root
    /// mean square over the record.
    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        let sum = |amplitudes: &[f64]| dot(amplitudes, amplitudes).sqrt();
        let amplitude = match form {
            IN_PROPORTION => data.full_scale_v * sum(&point[1..]),
            VARYING => hum_envelope::mean(&point[1..], over_time(data)),
            BY_RESPONSE => hum_envelope::mean(&point[1..], over_response(data)),
            STRETCH => sum(&point[1..3]),
            _ => sum(&point[1..]),
        };
        let mut quantities = vec![
            Quantity::new("amplitude", Dimension::ReadingSize, amplitude),
            Quantity::new("freq_hz", Dimension::Frequency, point[0]),
        ];
        if form == STRETCH {
            let rows = rows_of(point, data.rows());
            let at =
                |name, row: usize| Quantity::new(name, Dimension::TimePoint, data.time_s[row.min(data.rows() - 1)]);
            quantities.extend([at("from_s", rows.start), at("to_s", rows.end.saturating_sub(1))]);
        }
        quantities
    }

    fn ln_candidates(&self, form: usize, data: &Data) -> f64 {
        let rows = data.rows().max(2) as f64;
        // There are half as many independent frequencies as rows; 4.5 nats are paid with the three coordinates.
        let frequencies = ((rows / 2.0).ln() - 4.5).max(0.0);
        if form == STRETCH { frequencies + (rows * rows / 2.0).ln() } else { frequencies }
    }

    fn searched(&self, form: usize) -> bool {
        form == STRETCH
    }

    fn refine_searched(&self, _: usize, point: &mut [f64], FitContext { data, residual, .. }: &FitContext) {
        if let Some(best) = in_stretch(point[0], residual, data) {
            point.copy_from_slice(&best);
        }
    }

    fn searched_range(&self, form: usize, point: &[f64], context: &FitContext) -> Vec<(String, f64, f64)> {
        if form == VARYING {
            // Its phase changes as well, so that the frequency is known to the width of a line.
            let half_hz = 0.5 / context.data.duration_s();
            return vec![("freq_hz".into(), point[0] - half_hz, point[0] + half_hz)];
        }
        if form != STRETCH {
            return Vec::new();
        }
        let FitContext { data, residual, sigma } = context;
        let of_row = |(sin, cos): (f64, f64)| point[1] * cos + point[2] * sin;
        let sines: Vec<f64> = spectrum::oscillation(point[0], data).map(of_row).collect();
        // Cost of leaving a row without the sine, in nats; giving it to one costs the negative.
        let cost = |row: usize| (residual[row] * sines[row] - 0.5 * sines[row].powi(2)) / (sigma * sigma);
        let Range { start, end } = rows_of(point, data.rows());
        let from = boundary::range(start, data.rows(), |row| -cost(row), cost);
        let to = boundary::range(end, data.rows(), cost, |row| -cost(row));
        let bounds = |name: &str, rows: RangeInclusive<usize>| {
            (name.into(), data.time_s[*rows.start()], data.time_s[*rows.end()])
        };
        vec![bounds("from_s", from), bounds("to_s", to)]
    }

    fn modify_readings(&self, form: usize, point: &[f64], data: &Data, readings: &mut [f64]) {
        let amplitudes = &point[1..];
        let add = |reading: &mut f64, [cosine, sine]: [f64; 2], (sin, cos): (f64, f64)| {
            *reading += cosine * cos + sine * sin;
        };
        let oscillation = spectrum::oscillation(point[0], data);
        match form {
            VARYING => {
                for ((reading, turn), weights) in readings.iter_mut().zip(oscillation).zip(over_time(data)) {
                    add(reading, hum_envelope::at(amplitudes, weights), turn);
                }
            }
            BY_RESPONSE => {
                for (reading, turn) in readings.iter_mut().zip(oscillation) {
                    let weights = hum_envelope::at_response(*reading, data);
                    add(reading, hum_envelope::at(amplitudes, weights), turn);
                }
            }
            STRETCH => {
                let rows = rows_of(point, readings.len());
                for (reading, turn) in readings[rows.clone()].iter_mut().zip(oscillation.skip(rows.start)) {
                    add(reading, [amplitudes[0], amplitudes[1]], turn);
                }
            }
            _ => {
                for (reading, (sin, cos)) in readings.iter_mut().zip(oscillation) {
                    let mut turned = (1.0, 0.0);
                    let mut sum = 0.0;
                    for amplitudes in amplitudes.chunks_exact(2) {
                        turned = (turned.0 * cos - turned.1 * sin, turned.1 * cos + turned.0 * sin);
                        sum += amplitudes[0] * turned.0 + amplitudes[1] * turned.1;
                    }
                    *reading += if form == IN_PROPORTION { *reading * sum } else { sum };
                }
            }
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
