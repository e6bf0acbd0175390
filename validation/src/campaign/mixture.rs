//! The outlier size that can be detected in Gaussian noise, and that can be distinguished from heavy-tailed noise.
//!
//! The log-likelihood ratio of the true mixture over another distribution is a sum over rows and approximately normal:
//! with mean `m` and standard deviation `s` of one row it has mean `rows m` and standard deviation `sqrt(rows) s`.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use crate::ground_truth::Effect;
use crate::statistics::NORMAL_95;

/// Width of an integration cell, in standard deviations of the noise.
const STEP: f64 = 0.02;
/// Degrees of freedom of the Student's t distributions that outliers are compared with.
const TAILS: [f64; 6] = [2.3, 3.0, 4.0, 6.0, 10.0, 25.0];

/// Density of normal noise with outliers: positive half of a symmetric density, as positions and densities.
pub struct Mixture {
    cells: Vec<(f64, f64)>,
}

impl Mixture {
    /// Normal noise of standard deviation `sigma_v`, in V, with the outliers of an effect at size `size`.
    pub fn of(outliers: &Effect, size: f64, sigma_v: f64) -> Self {
        Self::new(outliers.full_size[0], size * outliers.full_size[1] / sigma_v)
    }

    /// Normal noise of standard deviation 1; a `fraction` of the readings is off by 0.5 to 1.5 times `far`, to either
    /// side.
    fn new(fraction: f64, far: f64) -> Self {
        let below = |x: f64| 0.5 * libm::erfc(-x * FRAC_1_SQRT_2);
        let one_side = |x: f64| below(x - 0.5 * far) - below(x - 1.5 * far);
        let density = |x: f64| {
            let outlying = (one_side(x) + one_side(-x)) / (2.0 * far);
            (1.0 - fraction) * normal(x) + fraction * outlying
        };
        // Up to 1.5 times `far`, and 8 standard deviations of the noise.
        let cells = 0..((1.5 * far + 8.0) / STEP) as u32;
        Self { cells: cells.map(|cell| STEP * (f64::from(cell) + 0.5)).map(|x| (x, density(x))).collect() }
    }

    /// Excess of the ratio over normal noise above what a test at the 5 % level with 95 % power needs; negative if
    /// undetectable.
    pub fn excess_over_noise(&self, rows: f64) -> f64 {
        let (mixed, mixed_scatter) = self.ratio(normal, |_, mixture| mixture);
        let (null, null_scatter) = self.ratio(normal, |x, _| normal(x));
        rows.sqrt() * (mixed - null) - NORMAL_95 * (null_scatter + mixed_scatter)
    }

    /// Excess of the ratio over the most likely Student's t above what makes the mixture more likely in 95 % of the
    /// records.
    pub fn excess_over_heavy_tail(&self, rows: f64) -> f64 {
        let scales = || (0..40).map(|part| 0.6 + 0.02 * f64::from(part));
        let tails = TAILS.into_iter().flat_map(|freedom| scales().map(move |scale| student(freedom, scale)));
        let ratios = tails.map(|tail| self.ratio(tail, |_, mixture| mixture));
        let (mean, scatter) = ratios.min_by(|a, b| a.0.total_cmp(&b.0)).expect("TAILS is not empty");
        rows.sqrt() * mean - NORMAL_95 * scatter
    }

    /// Mean and standard deviation, per row, of the log-likelihood ratio of the mixture over `other` for readings of
    /// density `density`.
    fn ratio(&self, other: impl Fn(f64) -> f64, density: impl Fn(f64, f64) -> f64) -> (f64, f64) {
        let (mut mean, mut square) = (0.0, 0.0);
        for &(x, mixture) in &self.cells {
            // Where both densities vanish the ratio is 1.
            let ratio = (mixture.max(1e-300) / other(x).max(1e-300)).ln();
            let probability = 2.0 * STEP * density(x, mixture);
            mean += probability * ratio;
            square += probability * ratio * ratio;
        }
        (mean, (square - mean * mean).max(0.0).sqrt())
    }
}

/// Density of the standard normal distribution.
fn normal(x: f64) -> f64 {
    (-0.5 * x * x).exp() / TAU.sqrt()
}

/// Density of Student's t distribution with `freedom` degrees of freedom, scaled by `scale`.
fn student(freedom: f64, scale: f64) -> impl Fn(f64) -> f64 {
    let constant = libm::lgamma(0.5 * (freedom + 1.0)) - libm::lgamma(0.5 * freedom) - 0.5 * (freedom * PI).ln();
    move |x| (constant - scale.ln() - 0.5 * (freedom + 1.0) * ((x / scale).powi(2) / freedom).ln_1p()).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_integrate_to_1() {
        for density in [normal as fn(f64) -> f64, |x| student(6.0, 1.3)(x)] {
            let half: f64 = (0..100_000).map(|cell| 1e-3 * density(1e-3 * (f64::from(cell) + 0.5))).sum();
            assert!((half - 0.5).abs() < 1e-4, "{half}");
        }
        let half: f64 = Mixture::new(0.03, 10.0).cells.iter().map(|(_, density)| STEP * density).sum();
        assert!((half - 0.5).abs() < 1e-4, "{half}");
    }

    /// Outliers of 2.3 standard deviations are detected but may be a heavy tail; those of 20 cannot.
    #[test]
    fn outliers_are_detected_before_they_are_distinguished_from_a_heavy_tail() {
        let (near, far) = (Mixture::new(0.03, 2.3), Mixture::new(0.03, 20.0));
        assert!(near.excess_over_noise(2401.0) > 0.0 && near.excess_over_heavy_tail(2401.0) < 0.0);
        assert!(far.excess_over_noise(2401.0) > 0.0 && far.excess_over_heavy_tail(2401.0) > 0.0);
    }
}
