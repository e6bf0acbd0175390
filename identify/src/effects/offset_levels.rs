//! The levels of an error that steps: where it steps, and its level from there on.
//!
//! Stretches are divided in two as long as that explains more than chance would, always at the place that explains most. A curve that
//! is not a step would be divided as well, so that a place counts only if the rows next to it differ nearly as much as the levels.

use crate::stats::median::{median, robust_deviation};
use crate::stats::scale::second_differences;
use crate::stats::thresholds::empirical::{PRICE_OF_RUN, SHORTEST_RUN};

/// Rows on each side of a place whose medians have to differ.
const NEXT_TO: usize = 5;
/// Smallest difference of these medians, relative to that of the levels.
const ABRUPT: f64 = 0.6;
/// Smallest difference of the levels, in scales of the noise.
const SMALLEST_STEP: f64 = 3.0;

/// A stretch of rows, from one up to but not including another, with the level of its errors, in V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) level: f64,
}

/// Sums of the seen errors and of their number up to each row.
struct Sums {
    errors: Vec<f64>,
    seen: Vec<f64>,
}

impl Sums {
    /// The squared error that a level of its own explains, over some rows.
    fn explained(&self, from: usize, to: usize) -> f64 {
        let (sum, seen) = (self.errors[to] - self.errors[from], self.seen[to] - self.seen[from]);
        if seen > 0.0 { sum * sum / seen } else { 0.0 }
    }

    fn seen(&self, from: usize, to: usize) -> usize {
        (self.seen[to] - self.seen[from]) as usize
    }
}

/// Returns at most `most` stretches of equal level of some errors, in which NaN rows are not seen; one if nothing steps.
pub(super) fn stretches(errors: &[f64], most: usize) -> Vec<Stretch> {
    let rows = errors.len();
    let values: Vec<f64> = errors.iter().copied().filter(|error| !error.is_nan()).collect();
    let sigma = robust_deviation(second_differences(&values)).unwrap_or(0.0);
    let mut sums = Sums { errors: vec![0.0], seen: vec![0.0] };
    for (row, error) in errors.iter().enumerate() {
        let (error, seen) = if error.is_nan() { (0.0, 0.0) } else { (*error, 1.0) };
        sums.errors.push(sums.errors[row] + error);
        sums.seen.push(sums.seen[row] + seen);
    }
    let least = 2.0 * sigma * sigma * (1.0 + PRICE_OF_RUN.get() * (rows as f64).max(1.0).ln());
    let mut ends = vec![0, rows];
    let mut divided: Vec<Option<(f64, usize)>> = vec![best_place(errors, &sums, sigma, 0, rows)];
    while ends.len() <= most {
        let best = divided.iter().enumerate().filter_map(|(index, place)| place.map(|(gain, at)| (gain, at, index)));
        let Some((_, at, index)) = best.filter(|(gain, ..)| *gain > least).max_by(|a, b| a.0.total_cmp(&b.0)) else {
            break;
        };
        ends.insert(index + 1, at);
        divided[index] = best_place(errors, &sums, sigma, ends[index], at);
        divided.insert(index + 1, best_place(errors, &sums, sigma, at, ends[index + 2]));
    }
    let level = |from: usize, to: usize| level(&errors[from..to]);
    ends.windows(2).map(|of| Stretch { from: of[0], to: of[1], level: level(of[0], of[1]) }).collect()
}

/// The median of the seen errors; 0 if there are none.
fn level(errors: &[f64]) -> f64 {
    let mut seen: Vec<f64> = errors.iter().copied().filter(|error| !error.is_nan()).collect();
    median(&mut seen).unwrap_or(0.0)
}

/// The step between some rows that explains most, with the squared error that it explains.
fn best_place(errors: &[f64], sums: &Sums, sigma: f64, from: usize, to: usize) -> Option<(f64, usize)> {
    let whole = sums.explained(from, to);
    let shortest = SHORTEST_RUN.count();
    let gain = |at: usize| sums.explained(from, at) + sums.explained(at, to) - whole;
    let mut places: Vec<(f64, usize)> = Vec::new();
    for at in from + shortest..to.saturating_sub(shortest) {
        let long = sums.seen(from, at) >= shortest && sums.seen(at, to) >= shortest;
        if long && is_abrupt(errors, sums, sigma, from, at, to) {
            places.push((gain(at), at));
        }
    }
    places.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
}

/// True if the rows next to a place differ as the levels next to it do, and by more than noise.
fn is_abrupt(errors: &[f64], sums: &Sums, sigma: f64, from: usize, at: usize, to: usize) -> bool {
    let mean =
        |from: usize, to: usize| (sums.errors[to] - sums.errors[from]) / (sums.seen[to] - sums.seen[from]).max(1.0);
    let near = mean(at, (at + NEXT_TO).min(to)) - mean(at.saturating_sub(NEXT_TO).max(from), at);
    if near.abs() < SMALLEST_STEP * sigma {
        return false;
    }
    // In a burst of stronger noise as well.
    let around = &errors[at.saturating_sub(4 * NEXT_TO).max(from)..(at + 4 * NEXT_TO).min(to)];
    if near.abs() < SMALLEST_STEP * robust_deviation(second_differences(around)).unwrap_or(0.0) {
        return false;
    }
    let next = [&errors[at.saturating_sub(NEXT_TO).max(from)..at], &errors[at..(at + NEXT_TO).min(to)]].map(level);
    let far = [(at.saturating_sub(4 * NEXT_TO).max(from), at), (at, (at + 4 * NEXT_TO).min(to))]
        .map(|(from, to)| level(&errors[from..to]));
    let (near, levels) = (next[1] - next[0], far[1] - far[0]);
    near * levels > 0.0 && near.abs() > ABRUPT * levels.abs() && levels.abs() > ABRUPT * near.abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    fn found(error: impl Fn(usize) -> f64) -> Vec<Stretch> {
        let errors: Vec<f64> = normals(2000).into_iter().enumerate().map(|(row, noise)| noise + error(row)).collect();
        stretches(&errors, 16)
    }

    #[test]
    fn steps_are_found_and_curves_are_not() {
        let levels = [0.0, 8.0, -5.0, 0.0, 6.0];
        let stepped = found(|row| levels[row / 400]);
        assert_eq!(stepped.len(), 5, "{stepped:?}");
        for (part, stretch) in stepped.iter().enumerate() {
            assert!(stretch.from.abs_diff(400 * part) < 3 && (stretch.level - levels[part]).abs() < 0.3, "{stretch:?}");
        }
        assert_eq!(found(|_| 0.0).len(), 1);
        assert_eq!(found(|row| 10.0 * (0.005 * row as f64).sin()).len(), 1);
        assert_eq!(
            found(|row| 20.0 * (-((row % 500) as f64) / 200.0).exp()).iter().filter(|it| it.from % 500 > 5).count(),
            0
        );
    }
}
