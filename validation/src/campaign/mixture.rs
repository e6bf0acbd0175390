//! How soon readings that are far off show, and how soon they cannot be a heavy tail of the noise instead.
//!
//! The log-likelihood ratio of the true mixture over another law is a sum over rows, taken as normal: with the mean `m` and
//! the scatter `s` of one row, `rows m` and `sqrt(rows) s`.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use super::detectable::NORMAL_95;
use crate::hidden::Effect;

/// Width of a cell, in standard deviations of the noise.
const STEP: f64 = 0.02;
/// Degrees of freedom of the heavy tails that may be taken for it.
const TAILS: [f64; 6] = [2.3, 3.0, 4.0, 6.0, 10.0, 25.0];

/// A half of a density that is symmetric: where, and how dense.
pub struct Mixture {
    cells: Vec<(f64, f64)>,
}

impl Mixture {
    /// What outliers of a size make of normal noise of a deviation, in V.
    pub fn of(outliers: &Effect, size: f64, sigma_v: f64) -> Self {
        Self::new(outliers.plain[0], size * outliers.plain[1] / sigma_v)
    }

    /// Normal noise of deviation 1, in which a part of the readings is half to one and a half times `far` off, either side.
    fn new(fraction: f64, far: f64) -> Self {
        let below = |x: f64| 0.5 * libm::erfc(-x * FRAC_1_SQRT_2);
        let one_side = |x: f64| below(x - 0.5 * far) - below(x - 1.5 * far);
        let density = |x: f64| {
            let outlying = (one_side(x) + one_side(-x)) / (2.0 * far);
            (1.0 - fraction) * normal(x) + fraction * outlying
        };
        // Up to 1.5 far off, and noise on top.
        let cells = 0..((1.5 * far + 8.0) / STEP) as u32;
        Self { cells: cells.map(|cell| STEP * (f64::from(cell) + 0.5)).map(|x| (x, density(x))).collect() }
    }

    /// How far the ratio over normal noise lies above what a test at the 5 % level with 95 % power needs.
    pub fn detected(&self, rows: f64) -> f64 {
        let (mixed, mixed_scatter) = self.ratio(normal, |_, mixture| mixture);
        let (null, null_scatter) = self.ratio(normal, |x, _| normal(x));
        rows.sqrt() * (mixed - null) - NORMAL_95 * (null_scatter + mixed_scatter)
    }

    /// How far the ratio over the likeliest Student's t lies above what makes the mixture the likelier one in 95 % of records.
    pub fn told_from_a_tail(&self, rows: f64) -> f64 {
        let scales = || (0..40).map(|part| 0.6 + 0.02 * f64::from(part));
        let tails = TAILS.into_iter().flat_map(|freedom| scales().map(move |scale| student(freedom, scale)));
        let ratios = tails.map(|tail| self.ratio(tail, |_, mixture| mixture));
        let (mean, scatter) = ratios.min_by(|a, b| a.0.total_cmp(&b.0)).expect("there are tails");
        rows.sqrt() * mean - NORMAL_95 * scatter
    }

    /// Mean and scatter of the logarithm of the mixture over another law, where readings come `as_often`.
    fn ratio(&self, other: impl Fn(f64) -> f64, as_often: impl Fn(f64, f64) -> f64) -> (f64, f64) {
        let (mut mean, mut square) = (0.0, 0.0);
        for &(x, mixture) in &self.cells {
            // Where both vanish there is nothing to weigh.
            let ratio = (mixture.max(1e-300) / other(x).max(1e-300)).ln();
            let often = 2.0 * STEP * as_often(x, mixture);
            mean += often * ratio;
            square += often * ratio * ratio;
        }
        (mean, (square - mean * mean).max(0.0).sqrt())
    }
}

fn normal(x: f64) -> f64 {
    (-0.5 * x * x).exp() / TAU.sqrt()
}

/// Student's t of a scale.
fn student(freedom: f64, scale: f64) -> impl Fn(f64) -> f64 {
    let constant = libm::lgamma(0.5 * (freedom + 1.0)) - libm::lgamma(0.5 * freedom) - 0.5 * (freedom * PI).ln();
    move |x| (constant - scale.ln() - 0.5 * (freedom + 1.0) * ((x / scale).powi(2) / freedom).ln_1p()).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_are_whole() {
        for density in [normal as fn(f64) -> f64, |x| student(6.0, 1.3)(x)] {
            let half: f64 = (0..100_000).map(|cell| 1e-3 * density(1e-3 * (f64::from(cell) + 0.5))).sum();
            assert!((half - 0.5).abs() < 1e-4, "{half}");
        }
        let half: f64 = Mixture::new(0.03, 10.0).cells.iter().map(|(_, density)| STEP * density).sum();
        assert!((half - 0.5).abs() < 1e-4, "{half}");
    }

    /// What is 2.3 deviations off is seen, and may be a heavy tail; what is 20 off is none.
    #[test]
    fn outliers_are_seen_before_they_are_told_from_a_tail() {
        let (near, far) = (Mixture::new(0.03, 2.3), Mixture::new(0.03, 20.0));
        assert!(near.detected(2401.0) > 0.0 && near.told_from_a_tail(2401.0) < 0.0);
        assert!(far.detected(2401.0) > 0.0 && far.told_from_a_tail(2401.0) > 0.0);
    }
}
