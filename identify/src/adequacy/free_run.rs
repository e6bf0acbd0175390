//! Check of the free-running error, without the noise's autoregression: what earlier voltages predict of it.
//!
//! An autoregression that is fitted to a residual predicts the error of a wrong law as well as noise, so that whitened errors
//! are small whatever the law. This check takes the error as it is. Means over blocks of rows are regressed on general functions
//! of the voltage and its past ([`voltage_history`](super::voltage_history)) by ridge regression, and predicted on segments that
//! the regression has not seen:
//!
//! ```text
//! share = (sum(e^2) - sum((e - predicted)^2)) / sum(e^2)            e: block means, held out in five folds of 40 segments
//! ```
//!
//! How much of the error noise may hold by chance depends on its colour, which the quickest differences show: noise whose two
//! finest octaves (variances `v` of differences of neighbours, and of neighbouring means of two) are alike is white there,
//!
//! ```text
//! |ln(v_2 / v_1)| < 4 sqrt(2 / n_1 + 2 / n_2)
//! ```
//!
//! and then nothing but a law puts a share of its power into the columns. How much they predict by chance of noise of another
//! colour is measured: shifted circularly along the record, the error keeps its colour, scale and outliers, but follows the
//! voltage no longer (surrogate data, as of Theiler et al., Physica D 58 (1992) 77). The limit is twice as far above the median
//! of the shifts' shares as the largest of them. Under a periodic voltage shifts by a period follow it as well, so that little
//! exceeds the limit; [`repetition`](super::repetition) finds what repeats.

use nalgebra::DMatrix;

use crate::adequacy::check::{Candidate, Check, Inadequacy, UnmodelledDynamics};
use crate::adequacy::localisation::Localisation;
use crate::adequacy::spikes::far_off;
use crate::adequacy::voltage_history::{Column, columns};
use crate::fit::engine::{Engine, Fit};
use crate::record::data::Data;
use crate::record::folds::folds_of_segments;
use crate::stats::scale::{centred, largest_magnitude, negligible, root_mean_square};
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{COLOUR_OF_WHITE, FEWEST_BLOCKS, SHARE_UNEXPLAINED};

/// Most blocks whose means are regressed.
const MOST_BLOCKS: usize = 600;
/// Ridges that are tried, relative to the columns' mean square; the one that predicts best counts.
const RIDGES: [f64; 3] = [1e-2, 1e-1, 1.0];

/// Number of circular shifts of the error, evenly spaced, that show what is predicted by chance.
const SHIFTS: usize = 37;

/// The check of a fit's free-running error.
pub(super) struct FreeRun;

impl Check for FreeRun {
    fn name(&self) -> &'static str {
        "free_run"
    }

    fn test(&self, engine: &mut Engine, Candidate { fit, .. }: &Candidate) -> Option<Inadequacy> {
        // The rounding error follows the stiffness by itself; records that are joined are also tested one by one.
        if fit.noise.half_step > 0.0 || engine.data.is_joined() {
            return None;
        }
        predictable(engine, fit).map(Inadequacy::from)
    }
}

/// The part of a fit's error that earlier voltages predict, if it is more than noise of its colour may hold.
fn predictable(engine: &Engine, fit: &Fit) -> Option<UnmodelledDynamics> {
    let errors = regular_errors(engine, fit);
    if errors.len() < FEWEST_BLOCKS.count() || negligible(&errors) {
        return None;
    }
    let response = engine.data.reading.iter().zip(&fit.residual).map(|(reading, residual)| reading - residual);
    let all = columns(engine.data, engine.base().relaxation.tau_s, &response.collect::<Vec<f64>>());
    follows(engine.data, &errors, all)
}

/// The part of errors in V that columns predict, if it is more than noise of their colour may hold.
fn follows(data: &Data, errors: &[f64], columns: Vec<Column>) -> Option<UnmodelledDynamics> {
    let rows_of_block = errors.len().div_ceil(MOST_BLOCKS);
    let target = means(errors, rows_of_block);
    let per_block = |column: Column| Column { values: standardised(&means(&column.values, rows_of_block)), ..column };
    let all: Vec<Column> = columns.into_iter().map(per_block).collect();
    let varies = |column: &&Column| column.values.iter().any(|value| *value != 0.0);
    let all: Vec<&Column> = all.iter().filter(varies).collect();
    let total = dot(errors, errors) / rows_of_block as f64;
    let [share] = predicted(&all, &[&target]).map(|reduction| reduction / total);
    let limit = if is_white(errors) { 0.0 } else { by_chance(&all, &target) / total };
    if share <= limit.max(SHARE_UNEXPLAINED.get()) {
        return None;
    }
    let of_group = |group: &str| {
        let own: Vec<&Column> = all.iter().copied().filter(|column| column.group == group).collect();
        let [reduction] = predicted(&own, &[&target]);
        reduction
    };
    let groups = all.chunk_by(|a, b| a.group == b.group).map(|columns| columns[0].group);
    let group = groups.max_by(|a, b| of_group(a).total_cmp(&of_group(b)))?;
    let place = format!("{group}{}", Localisation::new(data, errors).words());
    Some(UnmodelledDynamics::certain(place, share.min(1.0), share.min(1.0).sqrt() * root_mean_square(errors)))
}

/// Errors of constant scale, in V; readings beyond a bound and far-off ones count as 0.
pub(super) fn regular_errors(engine: &Engine, fit: &Fit) -> Vec<f64> {
    let errors = engine.observed.errors(&fit.residual);
    let mut even = fit.noise.weighted(&errors).into_owned();
    if fit.noise.outliers.is_some() {
        let far = far_off(&fit.noise, &fit.noise.innovations(&errors));
        even.iter_mut().zip(far).filter(|(_, far)| *far).for_each(|(error, _)| *error = 0.0);
    }
    even
}

/// True if the two finest octaves of the errors have the same variance, as those of white noise have.
fn is_white(errors: &[f64]) -> bool {
    let differences = |values: &[f64]| -> Vec<f64> { values.chunks_exact(2).map(|pair| pair[1] - pair[0]).collect() };
    let coarse = means(errors, 2);
    let [first, second] = [differences(errors), differences(&coarse)];
    let variance = |values: &[f64]| dot(values, values) / values.len().max(1) as f64;
    // A mean of two has half the variance of one.
    let ratio = 2.0 * variance(&second) / variance(&first).max(f64::MIN_POSITIVE);
    let error = (2.0 / first.len() as f64 + 2.0 / second.len() as f64).sqrt();
    ratio.ln().abs() < COLOUR_OF_WHITE.get() * error
}

/// Means of blocks of `rows` values; an incomplete last block is left out.
fn means(values: &[f64], rows: usize) -> Vec<f64> {
    values.chunks_exact(rows).map(|block| block.iter().sum::<f64>() / rows as f64).collect()
}

/// Values less their mean, with a mean square of 1; zeros if they are constant.
fn standardised(values: &[f64]) -> Vec<f64> {
    let largest = largest_magnitude(values);
    let centred = centred(values);
    let scale = root_mean_square(&centred);
    let constant = scale <= 1e-9 * largest;
    centred.into_iter().map(|value| if constant { 0.0 } else { value / scale }).collect()
}

/// Largest reduction of the sum of squares of an error with the colour of `target` that does not follow the voltage.
fn by_chance(columns: &[&Column], target: &[f64]) -> f64 {
    let shifted = |shift: usize| {
        let mut shifted = target.to_vec();
        shifted.rotate_right(target.len() * shift / (SHIFTS + 1));
        shifted
    };
    let mut by_shift = predicted(columns, &std::array::from_fn::<_, SHIFTS, _>(|shift| shifted(shift + 1)));
    by_shift.sort_by(f64::total_cmp);
    2.0 * by_shift[SHIFTS - 1] - by_shift[SHIFTS / 2]
}

/// Reduction of the sum of squares of each target on held-out segments, by its best ridge; negative if no ridge predicts.
fn predicted<const N: usize>(columns: &[&Column], targets: &[impl AsRef<[f64]>; N]) -> [f64; N] {
    let (rows, size) = (targets[0].as_ref().len(), columns.len() + 1);
    let value = |row: usize, column: usize| if column == 0 { 1.0 } else { columns[column - 1].values[row] };
    let all = DMatrix::from_fn(rows, size, value);
    let fold = folds_of_segments(rows);
    let folds = usize::from(fold.iter().copied().max().unwrap_or(0)) + 1;
    let mut left = [[0.0; RIDGES.len()]; N];
    for of in 0..folds {
        let (unseen, seen): (Vec<usize>, Vec<usize>) = (0..rows).partition(|&row| usize::from(fold[row]) == of);
        let [x, there] = [&seen, &unseen].map(|part| all.select_rows(part));
        let [y, read] = [&seen, &unseen]
            .map(|part| DMatrix::from_fn(part.len(), N, |at, target| targets[target].as_ref()[part[at]]));
        let (normal, right) = (x.tr_mul(&x), x.tr_mul(&y));
        for (ridge, at) in RIDGES.into_iter().zip(0..) {
            let mut damped = normal.clone();
            (1..size).for_each(|column| damped[(column, column)] += ridge * seen.len() as f64);
            let Some(factor) = damped.cholesky() else { continue };
            let errors = &read - &there * factor.solve(&right);
            left.iter_mut().zip(errors.column_iter()).for_each(|(left, own)| left[at] += own.norm_squared());
        }
    }
    std::array::from_fn(|target| {
        let best = left[target].into_iter().filter(|left| *left > 0.0).fold(f64::INFINITY, f64::min);
        dot(targets[target].as_ref(), targets[target].as_ref()) - best
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adequacy::fixture::{STEP_S, on_spring};
    use crate::record::input::Input;
    use crate::stats::coloured::{autoregressive, one_over_f};
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    const ROWS: usize = 2400;

    /// Tests the paper's spring on a record of one with the time constant `tau_s`, in s, under 60 levels of 4 s each.
    fn tested(tau_s: f64, noise: &[f64]) -> (Fit, Option<UnmodelledDynamics>) {
        let volts = |row: usize| 100.0 * (row / 40 * 7 % 6) as f64;
        on_spring(tau_s, volts, noise, |engine, fit| {
            let found = predictable(engine, &fit);
            (fit, found)
        })
    }

    /// The free run has 2.4 times the error of the noise; the autoregression takes nearly all of the excess.
    #[test]
    fn a_wrong_law_that_the_autoregression_follows_is_found() {
        let (fit, found) = tested(5.8, &normals(ROWS));
        assert!(!fit.noise.autocorrelation.is_white() && fit.noise.sigma < 1.2, "{:?}", fit.noise.sigma);
        let found = found.expect("a wrong time constant");
        assert!(found.significant && found.share > 0.6, "{found:?}");
        // A free run within 1 % of the noise counts as noise.
        assert_eq!(tested(5.51, &normals(ROWS)).1, None);
    }

    /// A diode between two filters, as seen from the best linear response: the error is smooth, and no lag of the voltage has it.
    #[test]
    fn a_law_between_two_oscillating_filters_is_found() {
        let volts: Vec<f64> = normals(ROWS).iter().map(|number| 100.0 * number).collect();
        let filtered = |values: Vec<f64>| -> Vec<f64> {
            let (mut value, mut slope) = (0.0, 0.0);
            let next = |input: f64| {
                slope += 0.04 * (input - value) - 0.2 * slope;
                value += slope;
                value
            };
            values.into_iter().map(next).collect()
        };
        let inner = filtered(volts.clone());
        let response = filtered(inner.clone());
        let limited = filtered(inner.iter().map(|value| value.min(0.5 * root_mean_square(&inner))).collect());
        let slope = dot(&centred(&response), &limited) / dot(&centred(&response), &response);
        let errors: Vec<f64> =
            limited.iter().zip(&response).map(|(limited, linear)| limited - slope * linear).collect();
        let errors = centred(&errors);
        let row =
            |row: usize| Row { line: row, time_s: STEP_S * row as f64, voltage_v: volts[row], measured: Some(0.0) };
        let data = Data::new(&Record { name: String::new(), rows: (0..ROWS).map(row).collect() }, Input::Hold);
        let found = follows(&data, &errors, columns(&data, 0.5, &response)).expect("a law between two filters");
        assert!(found.significant && found.place.contains("level of the response"), "{found:?}");
        // The same errors at another time: smooth, but not of this voltage.
        let mut elsewhere = errors.clone();
        elsewhere.rotate_right(ROWS / 3);
        assert_eq!(follows(&data, &elsewhere, columns(&data, 0.5, &response)), None);
    }

    #[test]
    fn noise_of_any_colour_is_not_predicted() {
        let noise = normals(160 * ROWS);
        for record in 0..16 {
            let noise = &noise[10 * record * ROWS..];
            let of_memory = |coefficient| autoregressive(&noise[..ROWS], coefficient);
            for noise in [of_memory(0.0), of_memory(0.9), of_memory(0.995), one_over_f(noise, ROWS)] {
                assert_eq!(tested(5.5, &noise).1, None, "{record}");
            }
        }
    }
}
