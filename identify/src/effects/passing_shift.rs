//! A shift of the readings that passes: it decays, or comes and goes by ramps.
//!
//! ```text
//! decay:  exp(-(t - t0) / tau) from t0 on
//! ramps:  0 to 1 over the first part of a stretch of rows, 1, and back to 0 over the last part
//! ```
//!
//! Errors of a wrong law of the spring are curves as well, and some shift explains a part of them. A shift that passes is therefore
//! looked for only if one explains most of what the errors have beyond noise; a decay also has to begin abruptly, and not at a change of the
//! voltage.

use crate::effects::effect::{FitContext, logarithms};
use crate::record::changes::changes;
use crate::record::data::Data;
use crate::stats::median::{median, robust_deviation, running_median};
use crate::stats::scale::second_differences;
use crate::stats::thresholds::empirical::{FEW_ROWS, MOST_OF_STRUCTURE, SHORTEST_RUN};

/// Number of decay times that are tried, and the longest, in durations of the record.
const TIMES: u32 = 8;
const LONGEST_TIME: f64 = 1.0;
/// Lengths of equal ramps that are tried first, relative to the stretch, then refined in steps up to half of it.
const RAMPS: [f64; 4] = [0.1, 0.2, 0.35, 0.5];
const RAMP_STEPS: u32 = 20;
/// Each length of a stretch that is tried is longer than the one before by this part, and each place is one of these parts of it later.
const LONGER: f64 = 0.1;
const PLACES: usize = 20;
/// Rounds of refinement.
const REFINEMENTS: usize = 8;
/// Scale of the median of five independent normal errors, relative to theirs.
const NOISE_OF_MEDIAN: f64 = 0.536;
/// Rows on each side of the beginning of a decay whose medians are compared, and the least change, relative to the shift.
const NEXT_TO: usize = 5;
const ABRUPT: f64 = 0.6;

/// Bounds of a decay time, in s.
pub(super) fn times_s(data: &Data) -> (f64, f64) {
    let shortest = SHORTEST_RUN.get() * data.sample_s;
    (shortest, (LONGEST_TIME * data.duration_s()).max(2.0 * shortest))
}

/// A stretch of rows, from one up to but not including another, with ramps at its beginning and its end, relative to its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ramped {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) ramps: [f64; 2],
}

impl Ramped {
    /// Numbers of rows of both ramps.
    pub(super) fn rows_of_ramps(&self) -> [usize; 2] {
        self.ramps.map(|ramp| ((ramp * (self.to - self.from) as f64) as usize).max(1))
    }

    /// Part of the shift at a row of the stretch.
    pub(super) fn at(&self, row: usize) -> f64 {
        let [first, last] = self.rows_of_ramps().map(|rows| rows as f64);
        let (since, left) = ((row - self.from) as f64 + 0.5, (self.to - row) as f64 - 0.5);
        (since / first).min(left / last).min(1.0)
    }
}

/// Errors without single far ones, with what they have beyond noise.
struct Errors {
    /// Errors, in V; 0 where they are not seen.
    smooth: Vec<f64>,
    seen: Vec<bool>,
    /// Sum of squares beyond noise, in V^2.
    structure: f64,
}

impl Errors {
    fn of(errors: &[f64]) -> Self {
        let seen: Vec<bool> = errors.iter().map(|error| !error.is_nan()).collect();
        let all: Vec<f64> = errors.iter().copied().filter(|error| !error.is_nan()).collect();
        let noise = robust_deviation(second_differences(&all)).unwrap_or(0.0);
        let is_short = all.len() < FEW_ROWS.count();
        let noise = if is_short { noise } else { NOISE_OF_MEDIAN * noise };
        let smoothed = if is_short { all } else { running_median(&all) };
        let structure = smoothed.iter().map(|error| error * error).sum::<f64>() - smoothed.len() as f64 * noise * noise;
        let mut smoothed = smoothed.into_iter();
        let smooth = seen.iter().map(|&seen| if seen { smoothed.next().unwrap_or(0.0) } else { 0.0 }).collect();
        Self { smooth, seen, structure }
    }

    fn are_explained_by(&self, gain: f64) -> bool {
        self.structure > 0.0 && gain > MOST_OF_STRUCTURE.get() * self.structure
    }

    fn is_abrupt(&self, row: usize, shift: f64) -> bool {
        let level = |rows: &[f64]| median(&mut rows.to_vec()).unwrap_or(0.0);
        let to = (row + NEXT_TO).min(self.smooth.len());
        let change = level(&self.smooth[row..to]) - level(&self.smooth[row.saturating_sub(NEXT_TO)..row]);
        change * shift > ABRUPT * shift * shift
    }
}

/// The decay that explains most of the residual, as first row, logarithm of its time in s, and shift in V; `None` if none explains most.
pub(super) fn best_decay(context: &FitContext) -> Option<Vec<f64>> {
    decay(context, logarithms(times_s(context.data), TIMES), true)
}

/// The decay of one of some times that explains most, wherever it begins; `is_new` asks for all that a first one needs.
pub(super) fn decay(context: &FitContext, ln_times: impl Iterator<Item = f64>, is_new: bool) -> Option<Vec<f64>> {
    let FitContext { data, residual, .. } = context;
    let errors = Errors::of(residual);
    let near_change = near_changes(data);
    let shortest = SHORTEST_RUN.count();
    let places = shortest..data.rows().saturating_sub(shortest);
    let mut best: Option<(f64, Vec<f64>)> = None;
    for ln_time in ln_times {
        let (mut product, mut square) = (0.0, 0.0);
        for row in (0..data.rows()).rev() {
            let left = data.time_s.get(row + 1).map_or(0.0, |next| (-(next - data.time_s[row]) / ln_time.exp()).exp());
            product = errors.smooth[row] + left * product;
            square = f64::from(u8::from(errors.seen[row])) + left * left * square;
            let (gain, shift) = (product * product / square.max(1e-9), product / square.max(1e-9));
            let may_begin = places.contains(&row) && !near_change[row];
            let is_best = may_begin && best.as_ref().is_none_or(|(most, _)| gain > *most);
            if is_best && (!is_new || errors.is_abrupt(row, shift)) {
                best = Some((gain, vec![row as f64, ln_time, shift]));
            }
        }
    }
    best.filter(|(gain, _)| !is_new || errors.are_explained_by(*gain)).map(|(_, point)| point)
}

/// Whether a row is next to a change of a voltage that is held in between.
fn near_changes(data: &Data) -> Vec<bool> {
    let mut near = vec![false; data.rows()];
    for (row, _) in changes(&data.voltage_v, data.full_scale_v) {
        let reach = row.saturating_sub(NEXT_TO)..(row + NEXT_TO).min(data.rows());
        near[reach].fill(true);
    }
    let held = near.iter().filter(|near| !**near).count();
    if 2 * held > data.rows() { near } else { vec![false; data.rows()] }
}

/// The stretch with ramps that explains most of the residual, with its shift, in V; `None` if none explains as much as a new one has to.
pub(super) fn best_ramps(FitContext { residual, .. }: &FitContext, is_new: bool) -> Option<(Ramped, f64)> {
    let errors = Errors::of(residual);
    let (rows, shortest) = (residual.len(), 2 * SHORTEST_RUN.count());
    let sums = Sums::of(&errors);
    let mut best = Best { stretch: Ramped { from: 0, to: shortest.min(rows), ramps: [0.5; 2] }, gain: 0.0 };
    let longer = |length: &usize| Some(length + ((LONGER * *length as f64) as usize).max(1));
    for length in std::iter::successors(Some(shortest), longer).take_while(|length| *length <= rows / 2) {
        for from in (0..=rows - length).step_by((length / PLACES).max(1)) {
            let stretch = |ramp: &f64| Ramped { from, to: from + length, ramps: [*ramp; 2] };
            RAMPS.iter().map(stretch).for_each(|stretch| best.consider(stretch, &sums));
        }
    }
    for _ in 0..REFINEMENTS {
        let reach = (best.stretch.to - best.stretch.from) / PLACES + 1;
        let Ramped { from, to, .. } = best.stretch;
        for from in from.saturating_sub(reach)..=(from + reach).min(to.saturating_sub(shortest)) {
            best.consider(Ramped { from, ..best.stretch }, &sums);
        }
        for to in (best.stretch.from + shortest).max(to.saturating_sub(reach))..=(to + reach).min(rows) {
            best.consider(Ramped { to, ..best.stretch }, &sums);
        }
        let ramps = || (0..=RAMP_STEPS).map(|step| 0.5 * f64::from(step) / f64::from(RAMP_STEPS));
        ramps().for_each(|ramp| best.consider(Ramped { ramps: [ramp, best.stretch.ramps[1]], ..best.stretch }, &sums));
        ramps().for_each(|ramp| best.consider(Ramped { ramps: [best.stretch.ramps[0], ramp], ..best.stretch }, &sums));
    }
    (!is_new || errors.are_explained_by(best.gain)).then(|| (best.stretch, sums.gain(&best.stretch).1))
}

/// The stretch that explains most so far, with the squared error that it explains, in V^2.
struct Best {
    stretch: Ramped,
    gain: f64,
}

impl Best {
    fn consider(&mut self, stretch: Ramped, sums: &Sums) {
        let gain = sums.gain(&stretch).0;
        if gain > self.gain {
            (self.stretch, self.gain) = (stretch, gain);
        }
    }
}

/// Sums of 1, `k` and `k^2` over the seen rows `k` up to each row, and of the errors times 1 and `k`.
struct Sums([Vec<f64>; 5]);

impl Sums {
    fn of(errors: &Errors) -> Self {
        let mut sums = [0.0; 5].map(|zero| vec![zero]);
        for (row, (error, seen)) in errors.smooth.iter().zip(&errors.seen).enumerate() {
            let (k, seen) = (row as f64 + 0.5, f64::from(u8::from(*seen)));
            for (sum, term) in sums.iter_mut().zip([seen, k * seen, k * k * seen, *error, k * error]) {
                sum.push(sum[row] + term);
            }
        }
        Self(sums)
    }

    /// The squared error that a stretch with ramps explains, in V^2, and its shift, in V.
    fn gain(&self, stretch: &Ramped) -> (f64, f64) {
        let &Ramped { from, to, .. } = stretch;
        let [first, last] = stretch.rows_of_ramps();
        let [rise, fall] = [first, last].map(|rows| 1.0 / rows as f64);
        let pieces = [
            (from, from + first, -(from as f64) * rise, rise),
            (from + first, to - last, 1.0, 0.0),
            (to - last, to, to as f64 * fall, -fall),
        ];
        let (mut product, mut square) = (0.0, 0.0);
        for (from, to, at_zero, slope) in pieces {
            let [ones, ks, squares, errors, moments] =
                std::array::from_fn(|sum| self.0[sum][to.max(from)] - self.0[sum][from]);
            product += at_zero * errors + slope * moments;
            square += at_zero * at_zero * ones + 2.0 * at_zero * slope * ks + slope * slope * squares;
        }
        if square > 0.0 { (product * product / square, product / square) } else { (0.0, 0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::input::Input;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    const ROWS: usize = 1500;

    /// Searches errors under a voltage that steps every 100 rows.
    fn search<T>(of: impl Fn(&FitContext) -> Option<T>, error: impl Fn(usize) -> f64) -> Option<T> {
        let volts = |row: usize| 100.0 * (row / 100 % 6) as f64;
        let row = |row: usize| Row { line: row, time_s: row as f64, voltage_v: volts(row), measured: Some(volts(row)) };
        let data = Data::new(&Record { name: String::new(), rows: (0..ROWS).map(row).collect() }, Input::Hold);
        let noise = normals(ROWS);
        let residual: Vec<f64> = (0..ROWS).map(|row| noise[row] + error(row)).collect();
        of(&FitContext { data: &data, residual: &residual, sigma: 1.0 })
    }

    fn new_ramps(context: &FitContext) -> Option<(Ramped, f64)> {
        best_ramps(context, true)
    }

    fn decays(from: usize) -> impl Fn(usize) -> f64 {
        move |row| if row < from { 0.0 } else { -12.0 * (-((row - from) as f64) / 120.0).exp() }
    }

    #[test]
    fn a_decay_is_found_unless_it_begins_with_a_change_of_the_voltage() {
        let found = search(best_decay, decays(640)).unwrap();
        assert!((found[0] - 640.0).abs() < 3.0 && (found[1].exp() / 120.0).ln().abs() < 0.7, "{found:?}");
        assert!(found[2] < -8.0, "{found:?}");
        assert_eq!(search(best_decay, decays(600)), None);
    }

    #[test]
    fn far_readings_hide_no_decay() {
        let found = search(best_decay, |row| decays(640)(row) + if row % 300 == 7 { 200.0 } else { 0.0 }).unwrap();
        assert!((found[0] - 640.0).abs() < 3.0, "{found:?}");
    }

    #[test]
    fn ramps_are_found_with_rows_that_are_not_seen() {
        let exact = Ramped { from: 500, to: 900, ramps: [0.1, 0.3] };
        let shape = |row: usize| if (500..900).contains(&row) { 6.0 * exact.at(row) } else { 0.0 };
        for hidden in [0..0, 550..650] {
            let error = |row: usize| if hidden.contains(&row) { f64::NAN } else { shape(row) };
            let (Ramped { from, to, ramps }, shift) = search(new_ramps, error).unwrap();
            assert!(
                from.abs_diff(500) < 20 && to.abs_diff(900) < 20 && (shift - 6.0).abs() < 0.3,
                "{from} {to} {shift}"
            );
            assert!((ramps[0] - 0.1).abs() < 0.06 && (ramps[1] - 0.3).abs() < 0.06, "{ramps:?}");
        }
    }

    #[test]
    fn waves_and_growing_errors_are_no_shift_that_passes() {
        let wave = |row: usize| 8.0 * (row as f64 / 100.0).sin();
        let growing = |row: usize| 10.0 * row as f64 / ROWS as f64;
        let with_voltage = |row: usize| 3.0 * (row / 100 % 6) as f64 - 7.0;
        for found in [search(best_decay, wave), search(best_decay, growing), search(best_decay, with_voltage)] {
            assert_eq!(found, None);
        }
        for found in [search(new_ramps, wave), search(new_ramps, with_voltage)] {
            assert_eq!(found, None);
        }
    }

    #[test]
    fn sums_over_the_pieces_are_those_over_the_rows() {
        let errors = Errors::of(&normals(200));
        let stretch = Ramped { from: 30, to: 130, ramps: [0.35, 0.1] };
        let shape: Vec<f64> =
            (0..200).map(|row| if (30..130).contains(&row) { stretch.at(row) } else { 0.0 }).collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let (product, square) = (dot(&shape, &errors.smooth), dot(&shape, &shape));
        let (gain, shift) = Sums::of(&errors).gain(&stretch);
        assert!((gain - product * product / square).abs() < 1e-9 && (shift - product / square).abs() < 1e-9);
    }
}
