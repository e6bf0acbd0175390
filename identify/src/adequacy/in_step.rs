//! Check for errors whose changes coincide with those of the simulated stiffness.
//!
//! An autoregression predicts a slow error whatever its cause, so that the error of a wrong law passes for autocorrelated
//! noise and the whitened residual shows nothing. Noise, however, is independent of the spring's motion. The check divides the
//! record into parts and correlates the change of the mean error from part to part with that of the simulated stiffness:
//!
//! ```text
//! s(x) = -ln(1 - (rank(x) - 1/2)/n)      z = sqrt(n - 1) corr(s(|change of the error|), s(|change of the stiffness|))
//! ```
//!
//! The scores are Savage's (*Annals of Mathematical Statistics* 27, 1956): large changes weigh most, and no single one
//! dominates. Changes of the means decorrelate quickly, however long the noise's autocorrelation is. The finding counts only
//! where the error is well above its scatter within the parts.

use crate::adequacy::check::{Candidate, Check, Inadequacy, UnmodelledDynamics};
use crate::fit::engine::Engine;
use crate::stats::scale::root_mean_square;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{ERROR_PER_SCATTER, ROWS_PER_MEAN};
use crate::stats::thresholds::probability::Z_IN_STEP;

/// Numbers of parts that the record is divided into: more parts resolve quick changes, fewer average louder noise.
const STEP_PARTS: [usize; 2] = [100, 200];

/// The check of a fit's free-running error.
pub(super) struct InStep;

impl Check for InStep {
    fn name(&self) -> &'static str {
        "in_step"
    }

    fn test(&self, engine: &mut Engine, Candidate { fit, .. }: &Candidate) -> Option<Inadequacy> {
        // The rounding error follows the stiffness by itself.
        if fit.noise.half_step > 0.0 {
            return None;
        }
        let stiffness: Vec<f64> =
            engine.data.reading.iter().zip(&fit.residual).map(|(read, left)| read - left).collect();
        let errors = engine.observed.errors(&fit.residual);
        in_step(&fit.noise.weighted(&errors), &stiffness).map(Inadequacy::from)
    }
}

/// Tests errors against the simulated stiffness, both in V, with each number of parts.
fn in_step(errors: &[f64], stiffness: &[f64]) -> Option<UnmodelledDynamics> {
    STEP_PARTS.into_iter().find_map(|parts| in_parts(parts, errors, stiffness))
}

fn in_parts(parts: usize, errors: &[f64], stiffness: &[f64]) -> Option<UnmodelledDynamics> {
    let length = errors.len() / parts;
    if length < ROWS_PER_MEAN.count() {
        return None;
    }
    let error = root_mean_square(errors);
    let share = 1.0 - (scatter(errors, length) / error.max(f64::MIN_POSITIVE)).powi(2);
    let [of_error, of_stiffness] = [errors, stiffness].map(|values| scores(&changes(values, length)));
    let z = correlation(&of_error, &of_stiffness) * (of_error.len() as f64 - 1.0).sqrt();
    (z > Z_IN_STEP && share > 1.0 - ERROR_PER_SCATTER.get().powi(-2)).then(|| {
        let place = "in step with the spring, as an error that changes when the stiffness does";
        UnmodelledDynamics::certain(place.into(), share, share.sqrt() * error)
    })
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Root mean square around the means of parts of `length` rows, in the unit of the values.
fn scatter(values: &[f64], length: usize) -> f64 {
    let around = |part: &[f64]| {
        let mean = mean(part);
        part.iter().map(|value| (value - mean).powi(2)).sum::<f64>()
    };
    (values.chunks_exact(length).map(around).sum::<f64>() / ((length - 1) * (values.len() / length)) as f64).sqrt()
}

/// Absolute change of the mean from each part of `length` rows to the next.
fn changes(values: &[f64], length: usize) -> Vec<f64> {
    let means: Vec<f64> = values.chunks_exact(length).map(mean).collect();
    means.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect()
}

/// Savage's scores of the values: expected order statistics of the exponential distribution, approximately.
fn scores(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut scores = vec![0.0; values.len()];
    for (rank, &of) in order.iter().enumerate() {
        scores[of] = -(1.0 - (rank as f64 + 0.5) / values.len() as f64).ln();
    }
    scores
}

/// Pearson correlation, -1 to 1.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let centred = |values: &[f64]| -> Vec<f64> {
        let mean = mean(values);
        values.iter().map(|value| value - mean).collect()
    };
    let (a, b) = (centred(a), centred(b));
    dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    const ROWS: usize = 2400;
    const STAIR: usize = 150;

    /// A stair up and down through a first-order lag with a time constant in rows.
    fn stiffness(tau: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut lag = 0.0;
        let follow = |row: usize| {
            let stair = row / STAIR % 10;
            lag += (100.0 * stair.min(10 - stair) as f64 - lag) / tau(row);
            lag
        };
        (0..ROWS).map(follow).collect()
    }

    /// First-order autoregressive noise of 1 V whose coefficient is `1 - fades`.
    fn noise(seed: usize, fades: f64) -> Vec<f64> {
        let mut last = 0.0;
        let follow = |noise: f64| {
            last = (1.0 - fades) * last + (fades * (2.0 - fades)).sqrt() * noise;
            last
        };
        normals(ROWS * (seed + 1))[ROWS * seed..].iter().copied().map(follow).collect()
    }

    #[test]
    fn a_wrong_time_constant_is_in_step() {
        let (read, simulated) = (stiffness(|row| 50.0 + 0.01 * row as f64), stiffness(|_| 60.0));
        for (seed, fades) in [1.0, 0.5, 0.1].into_iter().enumerate() {
            let noise = noise(seed, fades);
            let errors = |times: f64| -> Vec<f64> {
                let off = read.iter().zip(&simulated).map(|(read, simulated)| times * (read - simulated));
                off.zip(&noise).map(|(off, noise)| off + noise).collect()
            };
            let left = in_step(&errors(4.0), &simulated).expect("a wrong time constant");
            assert!(left.share > 0.75 && left.rms > 2.0, "{left:?}");
            // An error smaller than the noise does not count.
            assert_eq!(in_step(&errors(0.1), &simulated), None);
        }
    }

    #[test]
    fn autocorrelated_noise_is_not_in_step() {
        let simulated = stiffness(|_| 60.0);
        for seed in 0..40 {
            let errors = noise(seed, [1.0, 0.1, 0.03, 0.01][seed % 4]);
            assert_eq!(in_step(&errors, &simulated), None, "{seed}");
        }
    }
}
