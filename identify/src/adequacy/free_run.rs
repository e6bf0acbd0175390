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
//! and then nothing but a law puts a share of its power into the columns. Of 1/f noise they predict up to a fifth.

use nalgebra::{DMatrix, DVector};

use crate::adequacy::check::{Candidate, Check, Inadequacy, UnmodelledDynamics};
use crate::adequacy::localisation::Localisation;
use crate::adequacy::spikes::far_off;
use crate::adequacy::voltage_history::{Column, columns};
use crate::fit::engine::{Engine, Fit};
use crate::record::folds::folds_of_segments;
use crate::stats::scale::{centred, negligible, root_mean_square};
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{COLOUR_OF_WHITE, FEWEST_BLOCKS, SHARE_OF_COLOURED_NOISE, SHARE_UNEXPLAINED};

/// Most blocks whose means are regressed.
const MOST_BLOCKS: usize = 600;
/// Ridges that are tried, relative to the columns' mean square; the one that predicts best counts.
const RIDGES: [f64; 2] = [1e-2, 1e-1];

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

/// The part of the error that earlier voltages predict, if it is more than noise of its colour may hold.
fn predictable(engine: &Engine, fit: &Fit) -> Option<UnmodelledDynamics> {
    let errors = regular_errors(engine, fit);
    let rows_of_block = errors.len().div_ceil(MOST_BLOCKS);
    if errors.len() / rows_of_block < FEWEST_BLOCKS.count() || negligible(&errors) {
        return None;
    }
    let target = means(&errors, rows_of_block);
    let per_block = |column: Column| Column { values: standardised(&means(&column.values, rows_of_block)), ..column };
    let all: Vec<Column> = columns(engine.data, engine.base().relaxation.tau_s).into_iter().map(per_block).collect();
    let varies = |column: &&Column| column.values.iter().any(|value| *value != 0.0);
    let all: Vec<&Column> = all.iter().filter(varies).collect();
    let total = dot(&errors, &errors) / rows_of_block as f64;
    let limit = if is_white(&errors) { SHARE_UNEXPLAINED } else { SHARE_OF_COLOURED_NOISE };
    let share = predicted(&all, &target) / total;
    if share <= limit.get() {
        return None;
    }
    let of_group = |group: &str| {
        let own: Vec<&Column> = all.iter().copied().filter(|column| column.group == group).collect();
        predicted(&own, &target)
    };
    let groups = all.chunk_by(|a, b| a.group == b.group).map(|columns| columns[0].group);
    let group = groups.max_by(|a, b| of_group(a).total_cmp(&of_group(b)))?;
    let place = format!("{group}{}", Localisation::new(engine.data, &errors).words());
    Some(UnmodelledDynamics::certain(place, share.min(1.0), share.min(1.0).sqrt() * root_mean_square(&errors)))
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
    let largest = values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
    let centred = centred(values);
    let scale = root_mean_square(&centred);
    let constant = scale <= 1e-9 * largest;
    centred.into_iter().map(|value| if constant { 0.0 } else { value / scale }).collect()
}

/// Reduction of the sum of squares of `target` on held-out segments, by the best ridge; negative if no ridge predicts.
fn predicted(columns: &[&Column], target: &[f64]) -> f64 {
    let (rows, size) = (target.len(), columns.len() + 1);
    let value = |row: usize, column: usize| if column == 0 { 1.0 } else { columns[column - 1].values[row] };
    let all = DMatrix::from_fn(rows, size, value);
    let fold = folds_of_segments(rows);
    let folds = usize::from(fold.iter().copied().max().unwrap_or(0)) + 1;
    let mut left = [0.0; RIDGES.len()];
    for of in 0..folds {
        let (unseen, seen): (Vec<usize>, Vec<usize>) = (0..rows).partition(|&row| usize::from(fold[row]) == of);
        let [x, there] = [&seen, &unseen].map(|part| all.select_rows(part));
        let [y, read] = [&seen, &unseen].map(|part| DVector::from_fn(part.len(), |at, _| target[part[at]]));
        let (normal, right) = (x.tr_mul(&x), x.tr_mul(&y));
        for (left, ridge) in left.iter_mut().zip(RIDGES) {
            let mut damped = normal.clone();
            (1..size).for_each(|column| damped[(column, column)] += ridge * seen.len() as f64);
            let Some(factor) = damped.cholesky() else { continue };
            *left += (&read - &there * factor.solve(&right)).norm_squared();
        }
    }
    let best = left.into_iter().filter(|left| *left > 0.0).fold(f64::INFINITY, f64::min);
    dot(target, target) - best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adequacy::fixture::on_spring;
    use crate::stats::coloured::{autoregressive, one_over_f};
    use crate::stats::scale::normals;

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

    #[test]
    fn noise_of_any_colour_is_not_predicted() {
        let noise = normals(160 * ROWS);
        for record in 0..16 {
            let noise = &noise[10 * record * ROWS..];
            for noise in [noise[..ROWS].to_vec(), autoregressive(&noise[..ROWS], 0.9), one_over_f(noise, ROWS)] {
                assert_eq!(tested(5.5, &noise).1, None, "{record}");
            }
        }
    }
}
