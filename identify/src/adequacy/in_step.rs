//! Errors that keep step with the spring.
//!
//! An autoregression foretells a slow error, whatever its cause; what a wrong law leaves passes for noise with a memory, and
//! whitened nothing is left of it to test. But noise does not know when the spring moves. Over parts of the record, by how much
//! does the mean error change from one to the next, and by how much the simulated stiffness?
//!
//! ```text
//! s(x) = -ln(1 - (rank(x) - 1/2)/n)      z = sqrt(n - 1) corr(s(|change of the error|), s(|change of the stiffness|))
//! ```
//!
//! The scores are Savage's (*Annals of Mathematical Statistics* 27, 1956): large changes tell most, and none too much.
//! Changes from part to part forget quickly, however long the noise's memory. It matters where the error is far above what
//! it scatters within the parts.

use crate::adequacy::unmodelled::Leftover;
use crate::fit::engine::{Engine, Fit};
use crate::stats::scale::root_mean_square;
use crate::stats::sums::dot;

/// Parts of the record: many show quick changes, few those in loud noise.
const PARTS: [usize; 2] = [100, 200];
/// Shorter parts have no mean to speak of, in rows.
const SHORTEST: usize = 5;
/// By chance once in ten thousand records: scores that are exponential have a skew sum.
const RARE: f64 = 4.6;
/// An error so many times as large as its scatter within the parts is far above it.
const FAR: f64 = 2.0;

/// Tests the free-running error of a fit.
pub(crate) fn test(engine: &Engine, fit: &Fit) -> Option<Leftover> {
    // The error of rounding goes with the spring, and is no more than that.
    if fit.noise.half_step > 0.0 {
        return None;
    }
    let stiffness: Vec<f64> = engine.data.reading.iter().zip(&fit.residual).map(|(read, left)| read - left).collect();
    found(&fit.noise.weighted(&engine.observed.errors(&fit.residual)), &stiffness)
}

fn found(errors: &[f64], stiffness: &[f64]) -> Option<Leftover> {
    PARTS.into_iter().find_map(|parts| in_parts(parts, errors, stiffness))
}

fn in_parts(parts: usize, errors: &[f64], stiffness: &[f64]) -> Option<Leftover> {
    let length = errors.len() / parts;
    if length < SHORTEST {
        return None;
    }
    let error = root_mean_square(errors);
    let share = 1.0 - (scatter(errors, length) / error.max(f64::MIN_POSITIVE)).powi(2);
    let [of_error, of_stiffness] = [errors, stiffness].map(|values| scores(&changes(values, length)));
    let surprise = correlation(&of_error, &of_stiffness) * (of_error.len() as f64 - 1.0).sqrt();
    (surprise > RARE && share > 1.0 - FAR.powi(-2)).then(|| Leftover {
        place: "in step with the spring, as an error that changes when the stiffness does".into(),
        share,
        rms: share.sqrt() * error,
        significant: true,
        doubtful: true,
    })
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Root of the mean square around the parts' means.
fn scatter(values: &[f64], length: usize) -> f64 {
    let around = |part: &[f64]| {
        let mean = mean(part);
        part.iter().map(|value| (value - mean).powi(2)).sum::<f64>()
    };
    (values.chunks_exact(length).map(around).sum::<f64>() / ((length - 1) * (values.len() / length)) as f64).sqrt()
}

/// How far each part's mean is from the one before.
fn changes(values: &[f64], length: usize) -> Vec<f64> {
    let means: Vec<f64> = values.chunks_exact(length).map(mean).collect();
    means.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect()
}

fn scores(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut scores = vec![0.0; values.len()];
    for (rank, &of) in order.iter().enumerate() {
        scores[of] = -(1.0 - (rank as f64 + 0.5) / values.len() as f64).ln();
    }
    scores
}

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

    /// A stair up and down, followed with a time constant of so many rows.
    fn stiffness(tau: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut lag = 0.0;
        let follow = |row: usize| {
            let stair = row / STAIR % 10;
            lag += (100.0 * stair.min(10 - stair) as f64 - lag) / tau(row);
            lag
        };
        (0..ROWS).map(follow).collect()
    }

    /// Noise of 1 V whose memory fades by this part a row.
    fn noise(seed: usize, fades: f64) -> Vec<f64> {
        let mut last = 0.0;
        let follow = |noise: f64| {
            last = (1.0 - fades) * last + (fades * (2.0 - fades)).sqrt() * noise;
            last
        };
        normals(ROWS * (seed + 1))[ROWS * seed..].iter().copied().map(follow).collect()
    }

    #[test]
    fn an_error_that_keeps_step_is_no_noise() {
        let (read, simulated) = (stiffness(|row| 50.0 + 0.01 * row as f64), stiffness(|_| 60.0));
        for (seed, fades) in [1.0, 0.5, 0.1].into_iter().enumerate() {
            let noise = noise(seed, fades);
            let errors = |times: f64| -> Vec<f64> {
                let off = read.iter().zip(&simulated).map(|(read, simulated)| times * (read - simulated));
                off.zip(&noise).map(|(off, noise)| off + noise).collect()
            };
            let left = found(&errors(4.0), &simulated).expect("a wrong time constant");
            assert!(left.share > 0.75 && left.rms > 2.0, "{left:?}");
            // What is as large as the noise is no great matter.
            assert_eq!(found(&errors(0.1), &simulated), None);
        }
    }

    #[test]
    fn noise_keeps_step_with_nothing() {
        let simulated = stiffness(|_| 60.0);
        for seed in 0..40 {
            let errors = noise(seed, [1.0, 0.1, 0.03, 0.01][seed % 4]);
            assert_eq!(found(&errors, &simulated), None, "{seed}");
        }
    }
}
