//! Readings are shifted.
//!
//! | form | |
//! | --- | --- |
//! | run | one interval of them |
//! | whole | all of them: the sensor's zero |
//! | levels | several stretches, each by a constant of its own ([`offset_levels`](super::offset_levels)) |
//! | decay | from one row on, by a shift that decays exponentially ([`passing_shift`](super::passing_shift)) |
//! | ramps | a stretch of rows, by a shift that comes and goes by straight ramps |

use crate::dimension::Dimension;
use crate::effects::boundary;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::effects::offset_levels::{Stretch, stretches};
use crate::effects::passing_shift::{Ramped, best_decay, best_ramps, decay, times_s};
use crate::record::data::Data;
use crate::stats::median::{median, robust_deviation};
use crate::stats::scale::second_differences;
use crate::stats::shifted_run::{ShiftedRun, shifted_runs};
use crate::stats::thresholds::empirical::{PRICE_OF_RUN, ROWS_FOR_ZERO};
use crate::stats::thresholds::probability::Z_ZERO;

pub(super) struct ReadingOffset;

const RUN: usize = 0;
const WHOLE: usize = 1;
const LEVELS: usize = 2;
const DECAY: usize = 3;
const RAMPS: usize = 4;
/// Largest number of stretches with a level of their own.
const MOST_STRETCHES: usize = 16;
/// Fewest stretches that are more than one shifted run.
const FEWEST_STRETCHES: usize = 4;

/// Returns the point of the form with levels: the first rows of all stretches, then the shifts, in V. What is left of the places is
/// behind the record's end.
fn levels(rows: usize, stretches: &[Stretch]) -> Vec<f64> {
    let mut point = vec![rows as f64; MOST_STRETCHES];
    point.resize(2 * MOST_STRETCHES, 0.0);
    for (place, stretch) in stretches.iter().enumerate() {
        (point[place], point[MOST_STRETCHES + place]) = (stretch.from as f64, stretch.level);
    }
    point
}

/// Returns the stretches of a point of the form with levels.
fn stretches_of(point: &[f64], rows: usize) -> impl Iterator<Item = Stretch> {
    let (first, shifts) = point.split_at(MOST_STRETCHES);
    let starts = first.iter().map(move |&row| (row as usize).min(rows));
    let ends = starts.clone().skip(1).chain([rows]);
    let each = starts.zip(ends).zip(shifts).map(|((from, to), &level)| Stretch { from, to, level });
    each.filter(|stretch| stretch.from < stretch.to)
}

/// Returns the rows that are shifted and the shift, in V: rows from `point[0]` up to but not including `point[1]` by `point[2]`, all by
/// `point[0]`, or of several stretches the one that is shifted most. A shift that passes is given by its largest value.
fn shifted(form: usize, point: &[f64], rows: usize) -> (std::ops::Range<usize>, f64) {
    if form == WHOLE {
        return (0..rows, point[0]);
    }
    if form == DECAY {
        return ((point[0] as usize).min(rows)..rows, point[2]);
    }
    if form == LEVELS {
        let far = stretches_of(point, rows).max_by(|a, b| a.level.abs().total_cmp(&b.level.abs()));
        return far.map_or((0..0, 0.0), |far| (far.from..far.to, far.level));
    }
    let to = (point[1] as usize).min(rows);
    ((point[0] as usize).min(to)..to, point[if form == RAMPS { 4 } else { 2 }])
}

/// Returns the point of a shift that passes and explains most; one of several records is not looked for.
fn passing(form: usize, context: &FitContext) -> Option<Vec<f64>> {
    if context.data.is_joined() {
        return None;
    }
    if form == DECAY { best_decay(context) } else { ramps(context, true) }
}

/// Returns the point of the stretch with ramps that explains most.
fn ramps(context: &FitContext, is_new: bool) -> Option<Vec<f64>> {
    let (Ramped { from, to, ramps: [first, last] }, shift) = best_ramps(context, is_new)?;
    Some(vec![from as f64, to as f64, first, last, shift])
}

/// Returns false if the readings before the first voltage show that the sensor's zero is right.
fn shows_at_rest(data: &Data) -> bool {
    let rest = data.voltage_v.iter().take(ROWS_FOR_ZERO.count()).take_while(|voltage| **voltage == 0.0).count();
    if data.initial_state_unknown || rest == 0 {
        return true;
    }
    let zero = median(&mut data.reading[..rest].to_vec()).unwrap_or(0.0);
    let error = robust_deviation(second_differences(&data.reading)).unwrap_or(0.0) / (rest as f64).sqrt();
    let unreported = data.unreported_v.as_ref().map_or(0.0, |changes| changes.iter().copied().fold(0.0, f64::max));
    zero.abs() > unreported.max(Z_ZERO * error)
}

/// Returns the points of the runs whose shifts explain most, by level and by edges.
fn best_runs(context: &FitContext) -> [Option<Vec<f64>>; 2] {
    let point = |ShiftedRun { from, to, shift }| vec![from as f64, to as f64, shift];
    shifted_runs(context.residual, context.sigma).map(|run| run.map(point))
}

impl Effect for ReadingOffset {
    fn cause(&self) -> &'static str {
        "reading-offset"
    }

    fn location(&self) -> Location {
        Location::Reading
    }

    fn affects(&self, _: usize) -> Affects {
        Affects::Readings
    }

    fn first_of_last_rows(&self, form: usize, point: &[f64], data: &Data) -> Option<usize> {
        let (rows, _) = shifted(form, point, data.rows());
        (form != LEVELS && rows.start > 0 && rows.end == data.rows()).then_some(rows.start)
    }

    fn description(&self) -> &'static str {
        "a stretch of readings, or all, is shifted"
    }

    fn isolating_experiment(&self) -> &'static str {
        "the same schedule again, from a rest at 0 V: a shift of the sensor shows at rest, or not at the same time again"
    }

    fn forms(&self) -> usize {
        5
    }

    fn common_forms(&self) -> usize {
        2
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let rows = data.rows() as f64;
        let most = 2.0 * data.full_scale_v.max(1.0);
        let offset = Coordinate::new(-most, most);
        let start = data.normalisation.start.map_or(0.0, |start| start.offset);
        match form {
            RUN => vec![Coordinate::fixed(0.0, rows), Coordinate::fixed(0.0, rows), offset],
            LEVELS => [Coordinate::fixed(0.0, rows), offset].map(|it| vec![it; MOST_STRETCHES]).concat(),
            DECAY => {
                let (shortest, longest) = times_s(data);
                vec![Coordinate::fixed(0.0, rows), Coordinate::log(shortest, longest), offset]
            }
            RAMPS => {
                let (edge, ramp) = (Coordinate::fixed(0.0, rows), Coordinate::fixed(0.0, 0.5));
                vec![edge, edge, ramp, ramp, offset]
            }
            _ => vec![Coordinate::new(-most + 2.0 * start.min(0.0), most + 2.0 * start.max(0.0))],
        }
    }

    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>> {
        match form {
            RUN => best_runs(context).into_iter().flatten().collect(),
            LEVELS => {
                let found = stretches(context.residual, MOST_STRETCHES);
                let several = (found.len() >= FEWEST_STRETCHES).then(|| levels(context.data.rows(), &found));
                several.into_iter().collect()
            }
            DECAY | RAMPS => passing(form, context).into_iter().collect(),
            _ if !context.data.estimates_zero() && shows_at_rest(context.data) => {
                vec![vec![-context.sigma], vec![context.sigma]]
            }
            _ => Vec::new(),
        }
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        let (run, offset) = shifted(form, point, data.rows());
        let last = data.rows() - 1;
        let count = (form == LEVELS).then(|| {
            let shifts = stretches_of(point, data.rows()).count() as f64;
            Quantity::new("levels", Dimension::Ratio, shifts)
        });
        let to = |row: usize| Quantity::new("to_s", Dimension::TimePoint, data.time_s[row.min(last)]);
        let ends = match form {
            DECAY => Quantity::new("decay_s", Dimension::Time, point[1].exp()),
            _ => to(run.end.saturating_sub(1)),
        };
        let time_s = |row: usize| data.time_s[row.min(last)];
        let ramps = (form == RAMPS).then(|| {
            let ramped = Ramped { from: run.start, to: run.end, ramps: [point[2], point[3]] };
            let [first, fall] = ramped.rows_of_ramps();
            let rise_s = time_s(run.start + first) - time_s(run.start);
            let fall_s = time_s(run.end) - time_s(run.end.saturating_sub(fall));
            [("rise_s", rise_s), ("fall_s", fall_s)].map(|(name, time)| Quantity::new(name, Dimension::Time, time))
        });
        let from = Quantity::new("from_s", Dimension::TimePoint, data.time_s[run.start.min(last)]);
        let offset = Quantity::new("offset", Dimension::ReadingDifference, offset);
        [from, ends, offset].into_iter().chain(count).chain(ramps.into_iter().flatten()).collect()
    }

    fn ln_candidates(&self, form: usize, data: &Data) -> f64 {
        // Both edges are searched; neighbouring runs are nearly equivalent.
        let run = PRICE_OF_RUN.get() * (data.rows() as f64).max(1.0).ln();
        match form {
            RUN => run,
            // A run has two edges.
            LEVELS => 0.5 * MOST_STRETCHES as f64 * run,
            DECAY | RAMPS => run,
            _ => 0.0,
        }
    }

    fn searched(&self, form: usize) -> bool {
        form != WHOLE
    }

    fn refine_searched(&self, form: usize, point: &mut [f64], context: &FitContext) {
        if form == LEVELS {
            point.copy_from_slice(&levels(context.data.rows(), &stretches(context.residual, MOST_STRETCHES)));
            return;
        }
        if matches!(form, DECAY | RAMPS) {
            // A fit has moved the time of a decay.
            let found =
                if form == DECAY { decay(context, [point[1]].into_iter(), false) } else { ramps(context, false) };
            if let Some(best) = found {
                point.copy_from_slice(&best);
            }
            return;
        }
        let [by_level, by_edges] = best_runs(context);
        // A run that was placed by its edges stays near them.
        let by_edges = by_edges.filter(|run| run[0] < point[1] && point[0] < run[1]);
        let distance = |run: &Vec<f64>| (run[0] - point[0]).abs() + (run[1] - point[1]).abs();
        let nearest = by_level.into_iter().chain(by_edges).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(best) = nearest {
            point.copy_from_slice(&best);
        }
    }

    /// An edge lies between two rows.
    fn searched_range(&self, form: usize, point: &[f64], context: &FitContext) -> Vec<(String, f64, f64)> {
        let FitContext { data, residual, sigma } = context;
        if !matches!(form, RUN | DECAY) {
            return Vec::new();
        }
        let rows = data.rows();
        let (run, offset) = shifted(form, point, rows);
        // Cost of excluding a row, in nats; including one costs the negative.
        let cost = |row: usize| offset * (residual[row] - 0.5 * offset) / (sigma * sigma);
        let from = boundary::range(run.start.min(rows - 1), rows, |row| -cost(row), cost);
        let from = ("from_s".to_owned(), data.time_s[*from.start()], data.time_s[*from.end()]);
        let to = (form == RUN).then(|| {
            let to = boundary::range(run.end, rows, cost, |row| -cost(row));
            ("to_s".to_owned(), data.time_s[to.start().saturating_sub(1)], data.time_s[*to.end()])
        });
        [from].into_iter().chain(to).collect()
    }

    fn modify_readings(&self, form: usize, point: &[f64], data: &Data, readings: &mut [f64]) {
        if form == LEVELS {
            for Stretch { from, to, level } in stretches_of(point, data.rows()) {
                readings[from..to].iter_mut().for_each(|reading| *reading += level);
            }
            return;
        }
        let (run, offset) = shifted(form, point, data.rows());
        let begins_s = data.time_s[run.start.min(data.rows() - 1)];
        let ramps = [2, 3].map(|ramp| if form == RAMPS { point[ramp] } else { 0.0 });
        let ramped = Ramped { from: run.start, to: run.end, ramps };
        for row in run.clone() {
            readings[row] += match form {
                DECAY => offset * (-(data.time_s[row] - begins_s) / point[1].exp()).exp(),
                RAMPS => offset * ramped.at(row),
                _ => offset,
            };
        }
    }
}
