//! The tail of the innovations: a normal's, Student's t, or a mixture of two normals, by likelihood.

use super::{FINEST_V, Noise, scale, scale_of_squares};

const TAILS: [f64; 6] = [2.3, 3.0, 4.0, 6.0, 10.0, 25.0];
/// What a mixture must be better by than one heavy tail, in nats, to be outliers.
const OUTLIERS: f64 = 7.0;
/// Where more readings than this part are off, they are no outliers.
const MOST_OUTLIERS: f64 = 0.25;
/// Scale of outliers in the noise's scales, at least.
const WIDE: f64 = 4.0;

impl Noise {
    /// The likeliest scale for some innovations, by reweighting; the tail's shape stays.
    pub(super) fn fit_scale(&mut self, innovations: &[f64], rounds: usize) {
        let normal = self.nu.is_infinite() && self.wide.is_none();
        let start = if normal { scale_of_squares(innovations) } else { scale(innovations) };
        *self = self.scaled_to(start);
        if normal {
            return;
        }
        for _ in 0..rounds {
            let squares: f64 = innovations.iter().map(|&e| e * e * self.weight(e)).sum();
            let factor = (squares / innovations.len().max(1) as f64).sqrt();
            *self = self.scaled_to(self.sigma * factor);
        }
    }

    /// The same shape, of another scale.
    fn scaled_to(&self, sigma: f64) -> Self {
        let scaled = self.with_tail(self.nu, sigma);
        let wide = self.wide.map(|(fraction, wide)| (fraction, wide * scaled.sigma / self.sigma));
        Self { wide, ..scaled }
    }

    /// The likeliest tail of some innovations, and its scale.
    pub(super) fn fit_tail(&mut self, innovations: &[f64]) {
        let start = scale(innovations);
        let mut best = f64::NEG_INFINITY;
        let mut consider = |noise: &mut Self, tried: Self, cost: f64| {
            let log: f64 = innovations.iter().map(|&e| tried.exact_term(e).log).sum::<f64>() - cost;
            if log > best {
                best = log;
                *noise = tried;
            }
        };
        let normal = self.with_tail(f64::INFINITY, scale_of_squares(innovations));
        consider(self, normal.clone(), 0.0);
        for nu in TAILS {
            let mut heavy = normal.with_tail(nu, start);
            heavy.fit_scale(innovations, 8);
            consider(self, heavy, 2.0);
        }
        let far = innovations.iter().filter(|e| e.abs() > WIDE * start).count();
        if far >= 1 && innovations.len() >= 30 {
            let mixture = Self::mixture(innovations, start, &normal);
            if mixture.wide.is_some_and(|(fraction, _)| fraction < MOST_OUTLIERS) {
                consider(self, mixture, OUTLIERS);
            }
        }
    }

    /// Expectation-maximisation of two normals around zero.
    fn mixture(innovations: &[f64], start: f64, normal: &Self) -> Self {
        let count = innovations.len() as f64;
        let far: Vec<f64> = innovations.iter().copied().filter(|e| e.abs() > WIDE * start).collect();
        let (mut sigma, mut wide) = (start, scale_of_squares(&far).max(WIDE * start));
        let mut fraction = far.len() as f64 / count;
        for _ in 0..25 {
            let (mut weight, mut narrow_sum, mut wide_sum) = (0.0, 0.0, 0.0);
            for e in innovations {
                let normal = |scale: f64| (-0.5 * (e / scale).powi(2)).exp() / scale;
                let (a, b) = ((1.0 - fraction) * normal(sigma), fraction * normal(wide));
                let outlier = if a + b > 0.0 { b / (a + b) } else { 1.0 };
                weight += outlier;
                narrow_sum += (1.0 - outlier) * e * e;
                wide_sum += outlier * e * e;
            }
            fraction = (weight / count).clamp(1e-6, 0.5);
            sigma = (narrow_sum / (count - weight)).sqrt().max(FINEST_V);
            wide = (wide_sum / weight.max(1e-9)).sqrt().max(WIDE * sigma);
        }
        Self { wide: Some((fraction, wide)), ..normal.with_tail(f64::INFINITY, sigma) }
    }
}

/// Logarithm of the t distribution's constant.
pub(super) fn tail_constant(nu: f64) -> f64 {
    libm::lgamma(0.5 * (nu + 1.0)) - libm::lgamma(0.5 * nu) - 0.5 * (nu * std::f64::consts::PI).ln()
}
