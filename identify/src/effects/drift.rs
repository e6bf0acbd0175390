//! The response drifts with time, counted from the first reading.
//!
//! | form | |
//! | --- | --- |
//! | straight | `y (1 + rate t)` |
//! | exponential | `y exp(rate t)` |
//! | added | `y + rate t full scale` |
//! | step | `y factor` from one reading on, `y` before |
//! | wave, added wave | `y (1 + w)`, `y + w full scale` with `w = a cos(2 pi f t) + b sin(2 pi f t)`: fewer periods than a hum |
//! | settling, added settling | `y (1 + w)`, `y + w full scale` with `w = change (1 - exp(-t / T))`: as of a sensor that warms up |

use std::f64::consts::TAU;

use crate::dimension::Dimension;
use crate::effects::boundary;
use crate::effects::drive::Drive;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity, logarithms};
use crate::record::data::Data;
use crate::record::spectrum;
use crate::stats::shifted_run::autocorrelation;
use crate::stats::thresholds::empirical::{CLIP_FOR_RUN, FEWEST_PERIODS, LEAST_PART_OF_STEP, SHORTEST_RUN};

pub(super) struct Drift;

const STRAIGHT: usize = 0;
const EXPONENTIAL: usize = 1;
const STEP: usize = 3;
const WAVE: usize = 4;
const ADDED_WAVE: usize = 5;
const SETTLING: usize = 6;
const ADDED_SETTLING: usize = 7;
/// Fewest periods of a wave in the record; the beginning of a slower one is straight or settles.
const FEWEST_PERIODS_OF_WAVE: f64 = 0.75;
/// Intervals between the numbers of periods of initial waves, of which the best are tried.
const INITIAL_PERIODS: f64 = 0.5;
const INITIAL_WAVES: usize = 2;
/// A wave is not looked for where the voltage drives the spring this near to it, in periods per record, from where a fit would get there.
const BESIDE_DRIVEN: [f64; 3] = [-0.5, 0.0, 0.5];
/// Approximate number of rows in which initial waves are looked for.
const ROWS_OF_WAVES: usize = 400;
/// Number of times of a settling at initial points, and the longest time, in durations of the record.
const INITIAL_SETTLING: u32 = 4;
const LONGEST_SETTLING: f64 = 2.0;
/// Largest bound of the shortest time, relative to the longest.
const LATEST_SHORTEST: f64 = 0.25;

/// Returns the bounds of the time of a settling, in s: a faster one than the shortest is over before the record shows the response, and
/// is a gain error or a shift of all readings.
fn settling_times(data: &Data) -> (f64, f64) {
    let all: f64 = data.reading.iter().map(|reading| reading * reading).sum();
    let mut seen = data.reading.iter().scan(0.0, |sum, reading| {
        *sum += reading * reading;
        Some(*sum)
    });
    let row = seen.position(|sum| sum > LEAST_PART_OF_STEP.get() * all).unwrap_or(0);
    let longest = LONGEST_SETTLING * data.duration_s().max(1e-9);
    ((data.time_s[row] - data.time_s[0]).max(data.sample_s).min(LATEST_SHORTEST * longest), longest)
}

/// Returns the initial waves that explain most of the residual, as frequency, cosine and sine; a part of the rows shows so slow ones.
fn initial_waves(form: usize, FitContext { data, residual, .. }: &FitContext) -> Vec<Vec<f64>> {
    let every = data.rows().div_ceil(ROWS_OF_WAVES);
    let duration_s = data.duration_s().max(1e-9);
    let carrier = |row: usize| if form == WAVE { data.reading[row] } else { data.full_scale_v };
    let wave = |count: usize| {
        let frequency = INITIAL_PERIODS * count as f64 / duration_s;
        let [mut cc, mut ss, mut cs, mut c, mut s] = [0.0; 5];
        for row in (0..data.rows()).step_by(every) {
            let (sin, cos) = (TAU * frequency * (data.time_s[row] - data.time_s[0])).sin_cos();
            let (sin, cos) = (carrier(row) * sin, carrier(row) * cos);
            (cc, ss, cs) = (cc + cos * cos, ss + sin * sin, cs + cos * sin);
            (c, s) = (c + cos * residual[row], s + sin * residual[row]);
        }
        let determinant = cc * ss - cs * cs;
        let (a, b) = ((c * ss - s * cs) / determinant, (s * cc - c * cs) / determinant);
        (a * c + b * s, vec![frequency, a, b])
    };
    let most = (FEWEST_PERIODS.get() / INITIAL_PERIODS) as usize;
    let mut waves: Vec<(f64, Vec<f64>)> = (2..most).map(wave).filter(|(gain, _)| gain.is_finite()).collect();
    waves.sort_by(|a, b| b.0.total_cmp(&a.0));
    let drive = Drive::of(data);
    let apart = |point: &Vec<f64>| !BESIDE_DRIVEN.iter().any(|periods| drive.is_at(point[0] + periods / duration_s));
    waves.into_iter().map(|(_, point)| point).filter(apart).take(INITIAL_WAVES).collect()
}

/// Returns the row from which on a factor other than 1 reduces the squared error most, and the factor less 1; NaN rows do not count.
///
/// Errors that wander are whitened by their autocorrelation `phi`, as those of a [shifted run](crate::stats::shifted_run): the step's own
/// row counts with the whole reading, the rows behind it with what their reading changes.
fn best_step(FitContext { data, residual, sigma }: &FitContext) -> Option<Vec<f64>> {
    let least = LEAST_PART_OF_STEP.get();
    let seen = |row: usize| !residual[row].is_nan();
    let bound = CLIP_FOR_RUN.get() * sigma;
    let rows = residual.len();
    let clipped: Vec<f64> = (0..rows).filter(|&row| seen(row)).map(|row| residual[row].clamp(-bound, bound)).collect();
    let phi = autocorrelation(&clipped);
    let (mut product, mut square, mut power) = (0.0, 0.0, 0.0);
    let all: f64 = (0..rows).filter(|&row| seen(row)).map(|row| data.reading[row].powi(2)).sum();
    let mut best: Option<(f64, f64, f64)> = None;
    for row in (1..rows).rev() {
        let whitened = |of: &[f64]| of[row] - phi * of[row - 1];
        let (mut here, mut size) = (0.0, 0.0);
        if seen(row) && (phi == 0.0 || seen(row - 1)) {
            let left = whitened(residual);
            (here, size) = (left * data.reading[row], data.reading[row].powi(2));
            power += size;
            let long = rows - row >= SHORTEST_RUN.count() && row >= SHORTEST_RUN.count();
            let both = (least * all..=(1.0 - least) * all).contains(&power);
            let (product, square) = (product + here, square + size);
            if long && both && square > 0.0 && best.is_none_or(|(gain, ..)| product * product / square > gain) {
                best = Some((product * product / square, row as f64, product / square));
            }
            let change = whitened(&data.reading);
            (here, size) = (left * change, change * change);
        }
        product += here;
        square += size;
    }
    best.map(|(_, row, change)| vec![row, change])
}

impl Effect for Drift {
    fn cause(&self) -> &'static str {
        "drift"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    fn affects(&self, _: usize) -> Affects {
        Affects::Readings
    }

    fn description(&self) -> &'static str {
        "the response changes with time, not with the voltage"
    }

    fn isolating_experiment(&self) -> &'static str {
        "the same step again after a long time"
    }

    fn forms(&self) -> usize {
        8
    }

    fn common_forms(&self) -> usize {
        4
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        if form == STEP {
            return vec![Coordinate::fixed(0.0, data.rows() as f64), Coordinate::new(-0.9, 2.0)];
        }
        let duration_s = data.duration_s().max(1e-9);
        let change = Coordinate::new(-2.0, 2.0);
        match form {
            WAVE | ADDED_WAVE => {
                let frequency = Coordinate::new(FEWEST_PERIODS_OF_WAVE / duration_s, FEWEST_PERIODS.get() / duration_s);
                vec![frequency, change, change]
            }
            SETTLING | ADDED_SETTLING => {
                let (shortest, longest) = settling_times(data);
                vec![change, Coordinate::log(shortest, longest)]
            }
            _ => vec![Coordinate::new(-2.0 / duration_s, 2.0 / duration_s)],
        }
    }

    /// A step of one of several records is looked for in that record alone.
    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>> {
        if form == STEP {
            return best_step(context).into_iter().filter(|_| !context.data.is_joined()).collect();
        }
        let duration_s = context.data.duration_s().max(1e-9);
        match form {
            WAVE | ADDED_WAVE => initial_waves(form, context),
            SETTLING | ADDED_SETTLING => {
                let times = logarithms(settling_times(context.data), INITIAL_SETTLING);
                times.flat_map(|time| [vec![-0.05, time], vec![0.05, time]]).collect()
            }
            _ => vec![vec![-0.05 / duration_s], vec![0.05 / duration_s]],
        }
    }

    fn ln_candidates(&self, form: usize, data: &Data) -> f64 {
        match form {
            STEP => (data.rows() as f64).max(1.0).ln(),
            WAVE | ADDED_WAVE => FEWEST_PERIODS.get().ln(),
            _ => 0.0,
        }
    }

    fn searched(&self, form: usize) -> bool {
        form == STEP
    }

    fn refine_searched(&self, _: usize, point: &mut [f64], context: &FitContext) {
        if let Some(best) = best_step(context) {
            point.copy_from_slice(&best);
        }
    }

    fn searched_range(&self, form: usize, point: &[f64], context: &FitContext) -> Vec<(String, f64, f64)> {
        if form != STEP {
            return Vec::new();
        }
        let FitContext { data, residual, sigma } = context;
        let row = (point[0] as usize).min(data.rows() - 1);
        let change = |row: usize| point[1] * data.reading[row] / (1.0 + point[1]);
        // Cost of leaving a row without the factor, in nats; giving it to one costs the negative.
        let cost = |row: usize| (residual[row] * change(row) - 0.5 * change(row).powi(2)) / (sigma * sigma);
        let at = boundary::range(row, data.rows(), |row| -cost(row), cost);
        vec![("at_s".into(), data.time_s[*at.start()], data.time_s[*at.end()])]
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        if form == STEP {
            let at_s = data.time_s[(point[0] as usize).min(data.rows() - 1)];
            return vec![
                Quantity::new("factor", Dimension::Ratio, 1.0 + point[1]),
                Quantity::new("at_s", Dimension::TimePoint, at_s),
            ];
        }
        let relative = if matches!(form, WAVE | SETTLING) { Dimension::OfResponse } else { Dimension::OfFullScale };
        match form {
            WAVE | ADDED_WAVE => vec![
                Quantity::new("amplitude", relative, point[1].hypot(point[2])),
                Quantity::new("freq_hz", Dimension::Frequency, point[0]),
            ],
            SETTLING | ADDED_SETTLING => vec![
                Quantity::new("change", relative, point[0]),
                Quantity::new("settling_s", Dimension::Time, point[1].exp()),
            ],
            _ => vec![Quantity::new("per_s", Dimension::Rate, point[0])],
        }
    }

    fn modify_readings(&self, form: usize, point: &[f64], data: &Data, readings: &mut [f64]) {
        if form == STEP {
            let row = (point[0] as usize).min(readings.len());
            readings[row..].iter_mut().for_each(|reading| *reading *= 1.0 + point[1]);
            return;
        }
        if matches!(form, WAVE | ADDED_WAVE) {
            for (reading, (sin, cos)) in readings.iter_mut().zip(spectrum::oscillation(point[0], data)) {
                let carrier = if form == WAVE { *reading } else { data.full_scale_v };
                *reading += carrier * (point[1] * cos + point[2] * sin);
            }
            return;
        }
        let start = data.time_s.first().copied().unwrap_or(0.0);
        let settling = matches!(form, SETTLING | ADDED_SETTLING);
        for (reading, time) in readings.iter_mut().zip(&data.time_s) {
            let since = time - start;
            let grown = if settling { -point[0] * (-since / point[1].exp()).exp_m1() } else { point[0] * since };
            match form {
                STRAIGHT | SETTLING => *reading *= 1.0 + grown,
                EXPONENTIAL => *reading *= grown.exp(),
                _ => *reading += grown * data.full_scale_v,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::input::Input;
    use simulation::record::{Record, Row};
    use simulation::units::Units;

    const SECONDS: f64 = 240.0;

    /// Numbers of periods of the initial waves of a gain that oscillates `periods` times, under a voltage that does so `driven` times.
    fn found(driven: f64, periods: f64) -> Vec<f64> {
        let wave = |count: f64, time_s: f64| (TAU * count * time_s / SECONDS).sin();
        let row = |row: usize| {
            let time_s = 0.1 * row as f64;
            let voltage_v = 250.0 + 200.0 * wave(driven, time_s);
            Row { line: row, time_s, voltage_v, measured: Some(voltage_v) }
        };
        let record = Record { name: String::new(), rows: (0..2400).map(row).collect() };
        let data = Data::new(&record, Input::Hold);
        let drifts = |(reading, time_s): (&f64, &f64)| 0.05 * reading * wave(periods, *time_s);
        let residual: Vec<f64> = data.reading.iter().zip(&data.time_s).map(drifts).collect();
        let waves = initial_waves(WAVE, &FitContext { data: &data, residual: &residual, sigma: 1.0 });
        waves.iter().map(|point| point[0] * SECONDS).collect()
    }

    /// Under an added wave it is no part of the response.
    #[test]
    fn an_amplitude_is_shown_with_what_it_is_relative_to() {
        let row = |row: usize| Row { line: row, time_s: row as f64, voltage_v: 1.0, measured: Some(1.0) };
        let data = Data::new(&Record { name: String::new(), rows: (0..50).map(row).collect() }, Input::Hold);
        for (form, of) in [(WAVE, "response"), (ADDED_WAVE, "full scale"), (SETTLING, "response")] {
            let amplitude = Drift.quantities(form, &[0.1, 0.2, 0.3], &data).remove(0);
            let (unit, shown) =
                (amplitude.dimension.unit(&Units::default()), amplitude.dimension.shown_unit(&Units::default()));
            assert!(unit.is_empty() && shown.ends_with(of), "{form}: {shown}");
        }
    }

    #[test]
    fn no_wave_begins_where_the_voltage_drives_the_spring() {
        assert!(found(31.0, 4.0).iter().any(|periods| (periods - 4.0).abs() < 0.6));
        for periods in [3.5, 4.0, 4.5] {
            let all = found(4.0, periods);
            assert!(!all.is_empty() && all.iter().all(|found| (found - 4.0).abs() > 1.0), "{all:?}");
        }
    }
}
