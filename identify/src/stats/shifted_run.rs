//! The run of shifted errors that explains most: where it begins, where it ends, and its shift.
//!
//! Errors that wander, as those of a nominal spring that was identified from the shifted readings, have longer runs on one side of zero
//! than the shift itself. They are whitened by their autocorrelation `phi` from one row to the next, so that a run counts by its edges,
//! which nothing slow has, as well as by its level:
//!
//! ```text
//! w(k) = e(k) - phi e(k - 1)          e: error, w: what the error before does not predict
//! run:   1 in its first row (sqrt(1 - phi^2) in the record's first), 1 - phi in the others, -phi in the row after it
//! ```
//!
//! The squared error that a run explains is the squared sum of `w` times these, divided by the sum of their squares. Independent errors
//! have `phi = 0`, and a run counts by its level alone.

use crate::stats::median::{median, robust_deviation, running_median};
use crate::stats::scale::second_differences;
use crate::stats::thresholds::empirical::{CLIP_FOR_RUN, FEW_ROWS, SHORTEST_RUN, WHITENED_FROM};
use crate::stats::thresholds::probability::Z_RARE;

/// A run of rows, from one up to but not including another, that is shifted, in V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShiftedRun {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) shift: f64,
}

/// Whitened errors, with the sums from which what a run explains follows.
struct Whitened {
    phi: f64,
    /// What each error's predecessor does not predict of it, in V; 0 in rows that do not count.
    left: Vec<f64>,
    /// Sums of `left` up to each row, and the numbers of rows that count.
    sums: Vec<f64>,
    counts: Vec<usize>,
}

impl Whitened {
    /// Whitens errors; those of rows that do not count are NaN.
    fn new(errors: &[f64], phi: f64) -> Self {
        let (mut left, mut sums, mut counts) = (Vec::new(), vec![0.0], vec![0]);
        for (row, error) in errors.iter().enumerate() {
            let of_row = match row.checked_sub(1) {
                _ if phi == 0.0 => *error,
                None => (1.0 - phi * phi).sqrt() * error,
                Some(before) => error - phi * errors[before],
            };
            left.push(if of_row.is_nan() { 0.0 } else { of_row });
            sums.push(sums[row] + left[row]);
            counts.push(counts[row] + usize::from(!of_row.is_nan()));
        }
        Self { phi, left, sums, counts }
    }

    fn rows(&self) -> usize {
        self.left.len()
    }

    /// Returns the number of rows that count from one up to but not including another.
    fn count(&self, from: usize, to: usize) -> usize {
        self.counts[to] - self.counts[from]
    }

    /// Returns the shift of a run that explains most, in V, and the squared error that it explains, in V^2.
    fn best_shift(&self, from: usize, to: usize) -> (f64, f64) {
        let phi = self.phi;
        if phi == 0.0 {
            // One difference of sums, so that runs with the same rows that count explain exactly the same.
            let (sum, weight) = (self.sums[to] - self.sums[from], self.count(from, to) as f64);
            return (sum / weight, sum * sum / weight);
        }
        let begins = if from == 0 { (1.0 - phi * phi).sqrt() } else { 1.0 };
        let within = 1.0 - phi;
        let counts = |row: usize| self.count(row, row + 1) as f64;
        let mut sum = begins * self.left[from] + within * (self.sums[to] - self.sums[from + 1]);
        let mut weight = begins * begins * counts(from) + within * within * self.count(from + 1, to) as f64;
        if let Some(after) = self.left.get(to) {
            sum -= phi * after;
            weight += phi * phi * counts(to);
        }
        (sum / weight, sum * sum / weight)
    }

    fn gain(&self, from: usize, to: usize) -> f64 {
        let long = to > from && self.count(from, to) >= SHORTEST_RUN.count();
        if long { self.best_shift(from, to).1 } else { 0.0 }
    }

    /// Returns the run that explains most, up to half of the rows long: the others are shifted otherwise.
    fn best(&self) -> Option<(usize, usize)> {
        let (rows, shortest) = (self.rows(), SHORTEST_RUN.count());
        let longest = rows / 2;
        let lengths = std::iter::successors(Some(shortest), |length| Some(length + (length / 5).max(1)));
        let inner = lengths.take_while(|length| *length <= longest).flat_map(|length| {
            let starts = 0..=rows - length;
            starts.map(move |from| (from, from + length))
        });
        // Where only one edge shows, its place decides.
        let outer = (shortest..=longest).flat_map(|length| [(0, length), (rows - length, rows)]);
        let outer = outer.filter(|_| self.phi > 0.0);
        let (mut best, mut most) = (None, 0.0);
        for (from, to) in inner.chain(outer) {
            let gain = self.gain(from, to);
            if gain > most {
                (best, most) = (Some((from, to)), gain);
            }
        }
        best.map(|(from, to)| self.refined(from, to))
    }

    /// Returns the best run whose edges are close to those of the given one.
    fn refined(&self, from: usize, to: usize) -> (usize, usize) {
        let reach = ((to - from) / 4).clamp(3, 400);
        let shortest = SHORTEST_RUN.count();
        let (mut best, mut most) = ((from, to), self.gain(from, to));
        for _ in 0..3 {
            let before = best;
            for edge in best.0.saturating_sub(reach)..=(best.0 + reach).min(best.1.saturating_sub(shortest)) {
                let gain = self.gain(edge, best.1);
                if gain > most {
                    (best, most) = ((edge, best.1), gain);
                }
            }
            for edge in (best.0 + shortest).max(best.1.saturating_sub(reach))..=(best.1 + reach).min(self.rows()) {
                let gain = self.gain(best.0, edge);
                if gain > most {
                    (best, most) = ((best.0, edge), gain);
                }
            }
            if best == before {
                break;
            }
        }
        best
    }
}

/// Returns the run whose shift explains most of some errors by its level, and the one that does by its edges where the errors wander. Rows
/// with NaN count neither for nor against a run; `sigma` is the scale of the noise, in V. `None` for a run that is not shifted by more than
/// chance.
pub(crate) fn shifted_runs(errors: &[f64], sigma: f64) -> [Option<ShiftedRun>; 2] {
    let bound = CLIP_FOR_RUN.get() * sigma;
    let clipped: Vec<f64> = errors.iter().map(|error| error.clamp(-bound, bound)).collect();
    [by_level(errors, &clipped), by_edges(clipped)]
}

/// Returns the run that explains most by its level.
fn by_level(errors: &[f64], clipped: &[f64]) -> Option<ShiftedRun> {
    let (from, to) = Whitened::new(clipped, 0.0).best()?;
    let mut seen: Vec<f64> = errors[from..to].iter().copied().filter(|error| !error.is_nan()).collect();
    // In a burst of stronger noise the mean of a run is far from 0 by chance.
    let noise = robust_deviation(second_differences(&seen)).unwrap_or(0.0);
    // The median is not affected by an outlier in the run.
    let shift = median(&mut seen)?;
    (shift.abs() * (seen.len() as f64).sqrt() > Z_RARE * noise).then_some(ShiftedRun { from, to, shift })
}

/// Returns the run that explains most of errors by its edges; few errors have no autocorrelation of their own.
fn by_edges(mut errors: Vec<f64>) -> Option<ShiftedRun> {
    let seen: Vec<f64> = errors.iter().copied().filter(|error| !error.is_nan()).collect();
    if seen.len() < FEW_ROWS.count() {
        return None;
    }
    let phi = autocorrelation(&seen);
    if phi == 0.0 {
        return None;
    }
    // The edges that a single far reading has are none of a run.
    let smooth = running_median(&seen);
    errors.iter_mut().filter(|error| !error.is_nan()).zip(smooth).for_each(|(error, smooth)| *error = smooth);
    let whitened = Whitened::new(&errors, phi);
    let (from, to) = whitened.best()?;
    let (shift, gain) = whitened.best_shift(from, to);
    let noise = robust_deviation(whitened.left.iter().copied().filter(|left| *left != 0.0))?;
    (gain.sqrt() > Z_RARE * noise).then_some(ShiftedRun { from, to, shift })
}

/// Returns the autocorrelation of errors from one row to the next, by robust scales; 0 if it may be none.
pub(crate) fn autocorrelation(errors: &[f64]) -> f64 {
    let scale = robust_deviation(errors.iter().copied()).unwrap_or(0.0);
    let change = robust_deviation(errors.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.0);
    let phi = 1.0 - 0.5 * (change / scale).powi(2);
    if phi > WHITENED_FROM.get() { phi } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::{normals, robust_scale};

    /// Errors of which the rows 700 to 900 are shifted by 4 noise scales.
    fn shifted(slow: impl Fn(usize) -> f64) -> Vec<f64> {
        let shift = |row: usize| if (700..900).contains(&row) { 4.0 } else { 0.0 };
        normals(2000).into_iter().enumerate().map(|(row, noise)| noise + slow(row) + shift(row)).collect()
    }

    fn found(errors: &[f64]) -> ShiftedRun {
        let [by_level, by_edges] = shifted_runs(errors, robust_scale(errors));
        by_edges.or(by_level).expect("a run")
    }

    #[test]
    fn a_run_among_independent_errors_is_found_by_its_level() {
        let ShiftedRun { from, to, shift } = found(&shifted(|_| 0.0));
        assert!(from.abs_diff(700) <= 2 && to.abs_diff(900) <= 2 && (shift - 4.0).abs() < 0.3, "{from} {to} {shift}");
    }

    /// Ten times as far as the shift: a run by level alone is one of the waves.
    #[test]
    fn a_run_among_slow_errors_is_found_by_its_edges() {
        let wave = |row: usize| 20.0 * (row as f64 / 200.0).sin();
        let mut errors = shifted(wave);
        let ShiftedRun { from, to, shift } = found(&errors);
        assert!(from.abs_diff(700) <= 3 && to.abs_diff(900) <= 3 && (1.0..5.0).contains(&shift), "{from} {to} {shift}");
        // Far readings have edges of their own, and some rows are not seen.
        (0..2000).step_by(97).for_each(|row| errors[row] += 30.0);
        errors[400..500].fill(f64::NAN);
        let again = found(&errors);
        assert!(again.from.abs_diff(700) <= 3 && again.to.abs_diff(900) <= 3, "{again:?}");
    }

    #[test]
    fn a_run_to_the_end_has_one_edge() {
        let errors: Vec<f64> = (normals(1000).into_iter().enumerate())
            .map(|(row, noise)| noise + 20.0 * (row as f64 / 150.0).sin() + if row < 630 { 0.0 } else { 8.0 })
            .collect();
        let ShiftedRun { from, to, shift } = found(&errors);
        assert!(from.abs_diff(630) <= 3 && to == 1000 && (2.0..9.0).contains(&shift), "{from} {to} {shift}");
    }
}
