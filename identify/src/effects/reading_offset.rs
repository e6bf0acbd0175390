//! Readings are shifted by a constant.
//!
//! | form | |
//! | --- | --- |
//! | run | one stretch of them |
//! | whole | all of them: the sensor's zero |

use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::record::data::Data;
use crate::stats::median::{median, robust_deviation};
use crate::stats::scale::second_differences;

pub(super) struct ReadingOffset;

const RUN: usize = 0;
const WHOLE: usize = 1;

/// Shortest run that is one, in rows; a run that is longer than half of the record is the rest's offset.
const SHORTEST: usize = 5;
/// A single reading counts for no more than this many of the noise's scales.
const CLIP: f64 = 6.0;
/// First rows that tell the sensor's zero, and how many of their errors it is off if it is.
const AT_REST: usize = 10;
const SHOWN: f64 = 3.0;

/// Which rows are shifted, and by what: from `point[0]` up to but not including `point[1]` by `point[2]`; all by `point[0]`.
fn shifted(form: usize, point: &[f64], rows: usize) -> (std::ops::Range<usize>, f64) {
    if form == WHOLE {
        return (0..rows, point[0]);
    }
    let to = (point[1] as usize).min(rows);
    ((point[0] as usize).min(to)..to, point[2])
}

/// False if the sensor's zero is right: a spring that never had a voltage reads it.
fn shows_at_rest(data: &Data) -> bool {
    let rest = data.voltage_v.iter().take(AT_REST).take_while(|voltage| **voltage == 0.0).count();
    if data.initial_state_unknown || rest == 0 {
        return true;
    }
    let zero = median(&mut data.reading[..rest].to_vec()).unwrap_or(0.0);
    let error = robust_deviation(second_differences(&data.reading)).unwrap_or(0.0) / (rest as f64).sqrt();
    zero.abs() > SHOWN * error
}

/// The run whose shift explains most: by sums over runs of growing length. Unseen rows neither count nor cost.
fn best_run(FitContext { residual, sigma, .. }: &FitContext) -> Option<Vec<f64>> {
    let rows = residual.len();
    let bound = CLIP * sigma;
    let (mut sums, mut counts) = (vec![0.0], vec![0]);
    for (row, value) in residual.iter().enumerate() {
        let clipped = if value.is_nan() { 0.0 } else { value.clamp(-bound, bound) };
        sums.push(sums[row] + clipped);
        counts.push(counts[row] + usize::from(!value.is_nan()));
    }
    let gain = |from: usize, to: usize| match counts[to] - counts[from] {
        seen if seen < SHORTEST => 0.0,
        seen => (sums[to] - sums[from]).powi(2) / seen as f64,
    };
    let longest = rows / 2;
    let mut best = (0.0, 0, 0);
    let mut length = SHORTEST;
    while length <= longest {
        for from in 0..=rows - length {
            let found = gain(from, from + length);
            if found > best.0 {
                best = (found, from, from + length);
            }
        }
        length += (length / 5).max(1);
    }
    let (_, from, to) = refined(best.1, best.2, rows, &gain)?;
    // A typical reading, not the mean: it may hold an outlier.
    let mut run: Vec<f64> = residual[from..to].iter().copied().filter(|value| !value.is_nan()).collect();
    run.sort_by(f64::total_cmp);
    Some(vec![from as f64, to as f64, run[run.len() / 2]])
}

/// The best run with its edges near those of another.
fn refined(from: usize, to: usize, rows: usize, gain: &impl Fn(usize, usize) -> f64) -> Option<(f64, usize, usize)> {
    if to <= from {
        return None;
    }
    let reach = ((to - from) / 4).clamp(3, 400);
    let mut best = (gain(from, to), from, to);
    for _ in 0..3 {
        let before = best;
        for edge in best.1.saturating_sub(reach)..=(best.1 + reach).min(best.2 - SHORTEST.min(best.2 - best.1)) {
            let found = gain(edge, best.2);
            if found > best.0 && best.2 - edge >= SHORTEST {
                best = (found, edge, best.2);
            }
        }
        for edge in (best.1 + SHORTEST).max(best.2.saturating_sub(reach))..=(best.2 + reach).min(rows) {
            let found = gain(best.1, edge);
            if found > best.0 {
                best = (found, best.1, edge);
            }
        }
        if best == before {
            break;
        }
    }
    Some(best)
}

impl Effect for ReadingOffset {
    fn cause(&self) -> &'static str {
        "reading-offset"
    }

    fn location(&self) -> Location {
        Location::Reading
    }

    fn affects(&self) -> Affects {
        Affects::Readings
    }

    fn description(&self) -> &'static str {
        "a stretch of readings, or all, is shifted"
    }

    fn isolating_experiment(&self) -> &'static str {
        "the same schedule again, from a rest at 0 V: a shift of the sensor shows at rest, or not at the same time again"
    }

    fn forms(&self) -> usize {
        2
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let rows = data.rows() as f64;
        let most = 2.0 * data.full_scale_v.max(1.0);
        let offset = Coordinate::new(-most, most);
        match form {
            RUN => vec![Coordinate::fixed(0.0, rows), Coordinate::fixed(0.0, rows), offset],
            _ => vec![offset],
        }
    }

    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>> {
        match form {
            RUN => best_run(context).into_iter().collect(),
            _ if shows_at_rest(context.data) => vec![vec![-context.sigma], vec![context.sigma]],
            _ => Vec::new(),
        }
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        let (run, offset) = shifted(form, point, data.rows());
        let last = data.rows() - 1;
        vec![
            Quantity::new("from_s", "s", data.time_s[run.start.min(last)]),
            Quantity::new("to_s", "s", data.time_s[run.end.saturating_sub(1).min(last)]),
            Quantity::new("offset", "V", offset),
        ]
    }

    fn ln_candidates(&self, form: usize, data: &Data) -> f64 {
        // Both edges; neighbouring runs are nearly the same.
        if form == RUN { 1.25 * (data.rows() as f64).max(1.0).ln() } else { 0.0 }
    }

    fn searched(&self, form: usize) -> bool {
        form == RUN
    }

    fn refine_searched(&self, _: usize, point: &mut [f64], context: &FitContext) {
        if let Some(best) = best_run(context) {
            point.copy_from_slice(&best);
        }
    }

    /// An edge may lie where moving it costs less than 95 % certainty allows, and between two rows.
    fn searched_range(&self, form: usize, point: &[f64], context: &FitContext) -> Vec<(String, f64, f64)> {
        if form != RUN {
            return Vec::new();
        }
        let (time, rows) = (&context.data.time_s, context.data.rows());
        let (from, to, offset) = (point[0] as usize, (point[1] as usize).min(rows), point[2]);
        // Cost of counting a row of the run as outside, in nats; the opposite is a gain.
        let cost =
            |row: usize| (context.residual[row] * offset - 0.5 * offset * offset) / (context.sigma * context.sigma);
        let reach = |outwards: &mut dyn Iterator<Item = usize>, sign: f64| {
            let (mut sum, mut last) = (0.0, None);
            for row in outwards.take(200) {
                sum += sign * cost(row);
                if sum < 2.0 {
                    last = Some(row);
                }
                if sum > 8.0 {
                    break;
                }
            }
            last
        };
        let at = |row: usize| time[row.min(rows - 1)];
        let lower = reach(&mut (0..from).rev(), -1.0).unwrap_or(from).saturating_sub(1);
        let upper = reach(&mut (from..to), 1.0).map_or(from, |row| row + 1);
        let earlier = reach(&mut (from..to).rev(), 1.0).unwrap_or(to).saturating_sub(1);
        let later = reach(&mut (to..rows), -1.0).map_or(to, |row| row + 1);
        vec![("from_s".into(), at(lower), at(upper)), ("to_s".into(), at(earlier.saturating_sub(1)), at(later))]
    }

    fn modify_readings(&self, form: usize, point: &[f64], data: &Data, readings: &mut [f64]) {
        let (run, offset) = shifted(form, point, data.rows());
        for reading in &mut readings[run] {
            *reading += offset;
        }
    }
}
