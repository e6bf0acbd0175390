//! The law of the noise: autocorrelation, scale and tail, and the likelihood of readings under it.
//!
//! ```text
//! phi(B) (1 - B)^power (weight r) = e,      e ~ Student t of scale sigma and nu degrees of freedom (normal for nu = inf)
//!                                           or a mixture of two normals, the wider one for outliers
//! ```

use std::borrow::Cow;
use std::sync::Arc;

use crate::noise::autocorrelation::Autocorrelation;
use crate::noise::term::{HALF_LN_TAU, Term, in_cell, mixture, stopped};
use crate::record::observed::{Kind, Observed};
use crate::stats::scale::robust_scale;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::FINEST_V;

/// The law of the noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Scale of the innovations, in V.
    pub sigma: f64,
    /// Degrees of freedom of Student's t distribution; infinite for a normal one.
    pub nu: f64,
    /// Autocorrelation of the residual.
    pub autocorrelation: Autocorrelation,
    /// Fraction of outliers, and their scale in V; `None` without outliers.
    pub outliers: Option<(f64, f64)>,
    /// Half of the quantisation step if that is coarse compared with the noise, in V, else 0.
    pub half_step: f64,
    /// Scale of the residual itself, autocorrelated part included, in V.
    pub marginal: f64,
    /// Reciprocal scale of each row, with a geometric mean of 1; `None` if the scale is constant.
    pub(super) weights: Option<Arc<[f64]>>,
    /// Part of the log-density that does not depend on the residual.
    pub(super) constant: f64,
}

impl Noise {
    /// Returns the law for first fits: independent noise with a moderately heavy tail, and a scale of 1 V.
    pub fn default_robust() -> Self {
        Self::robust(&[1.0])
    }

    /// Returns the law of [`Noise::default_robust`] with the robust scale of a residual, in V.
    pub fn robust(residual: &[f64]) -> Self {
        let sigma = robust_scale(residual);
        let noise = Self {
            sigma,
            nu: 5.0,
            autocorrelation: Autocorrelation::default(),
            outliers: None,
            half_step: 0.0,
            marginal: sigma,
            weights: None,
            constant: 0.0,
        };
        noise.with_tail(5.0, sigma)
    }

    /// Returns the same law with another tail and scale, at least [`FINEST_V`].
    pub(super) fn with_tail(&self, nu: f64, sigma: f64) -> Self {
        let sigma = sigma.max(FINEST_V.get());
        let shape = if nu.is_finite() { tail_constant(nu) } else { -HALF_LN_TAU };
        Self { nu, sigma, constant: shape - sigma.ln(), ..self.clone() }
    }

    /// Returns the size, in V, below which a misfit is hidden by the noise, however many rows show it.
    pub fn floor_v(&self) -> f64 {
        self.marginal.max(self.half_step)
    }

    /// Returns the innovations of a change of the prediction, in V: weighted, and filtered by the autocorrelation.
    pub fn whitened(&self, change: &[f64]) -> Vec<f64> {
        self.autocorrelation.whitened(&self.weighted(change))
    }

    /// Returns the innovations of a residual, in V; outliers do not affect later rows.
    pub fn innovations(&self, residual: &[f64]) -> Vec<f64> {
        if self.outliers.is_some() {
            self.autocorrelation.innovations(&self.weighted(residual))
        } else {
            self.whitened(residual)
        }
    }

    /// Returns the values multiplied by the weights of their rows, so that their noise has a constant scale.
    pub fn weighted<'v>(&self, values: &'v [f64]) -> Cow<'v, [f64]> {
        match &self.weights {
            None => Cow::Borrowed(values),
            Some(weights) => values.iter().zip(&**weights).map(|(value, weight)| value * weight).collect(),
        }
    }

    /// Returns the contribution of a row to a fit, from its residual and its innovation, in V.
    pub fn term(&self, kind: Kind, residual: f64, innovation: f64) -> Term {
        match self.of_interval(kind, residual) {
            Some((_, term)) => term,
            None => Term { residual: innovation, weight: self.weight(innovation) },
        }
    }

    /// Returns the log-probability of a row's reading, up to a constant, from its residual and its innovation, in V.
    pub fn log_density(&self, kind: Kind, residual: f64, innovation: f64) -> f64 {
        self.of_interval(kind, residual).map_or_else(|| self.exact_log_density(innovation), |(log, _)| log)
    }

    /// Returns log-probability and term of a reading that is known up to an interval: it stopped at a bound, was rounded to a
    /// coarse step, has a code next to missing ones, or was not reported. Returns `None` for any other.
    fn of_interval(&self, kind: Kind, residual: f64) -> Option<(f64, Term)> {
        match kind {
            // Rounded readings reach a bound half a step before it.
            Kind::AtLeast => Some(stopped(residual - self.half_step, self.marginal)),
            Kind::AtMost => {
                let (log, term) = stopped(-residual - self.half_step, self.marginal);
                Some((log, Term { residual: -term.residual, ..term }))
            }
            Kind::Within(low, high) => Some(in_cell(residual + 0.5 * (low + high), self.marginal, 0.5 * (high - low))),
            Kind::Unreported(change) => Some(in_cell(residual, self.marginal, change)),
            Kind::Exact if self.half_step > 0.0 => {
                let of = |scale: f64| in_cell(residual, scale, self.half_step);
                let mixed = |(fraction, wide): (f64, f64)| mixture(fraction, of(self.sigma), of(wide));
                Some(self.outliers.map_or_else(|| of(self.sigma), mixed))
            }
            Kind::Exact => None,
        }
    }

    /// Returns the log-density of the innovation `e`, in V, of a reading that is not known up to an interval only.
    pub(super) fn exact_log_density(&self, e: f64) -> f64 {
        match self.outliers {
            Some(_) => self.densities(e).iter().sum::<f64>().max(1e-300).ln() - HALF_LN_TAU,
            None if self.nu.is_infinite() => self.constant - 0.5 * (e / self.sigma).powi(2),
            None => self.constant - 0.5 * (self.nu + 1.0) * ((e / self.sigma).powi(2) / self.nu).ln_1p(),
        }
    }

    /// Returns minus the derivative of the log-density divided by the innovation, in 1/V^2.
    pub(super) fn weight(&self, e: f64) -> f64 {
        let variance = self.sigma * self.sigma;
        if let Some((_, wide)) = self.outliers {
            let [narrow, far] = self.densities(e);
            return (narrow / variance + far / (wide * wide)) / (narrow + far).max(1e-300);
        }
        if self.nu.is_infinite() {
            return 1.0 / variance;
        }
        (self.nu + 1.0) / (self.nu * variance + e * e)
    }

    /// Returns the densities of a regular reading and of an outlier, without the factor `1 / sqrt(2 pi)`.
    fn densities(&self, e: f64) -> [f64; 2] {
        let (fraction, wide) = self.outliers.unwrap_or((0.0, self.sigma));
        let normal = |scale: f64| (-0.5 * (e / scale).powi(2)).exp() / scale;
        [(1.0 - fraction) * normal(self.sigma), fraction * normal(wide)]
    }

    /// Returns the log-likelihood of all rows, in nats.
    pub fn log_likelihood(&self, residual: &[f64], observed: &Observed) -> f64 {
        self.log_likelihood_of(residual, &self.innovations(&observed.errors(residual)), observed)
    }

    /// Returns the same for a residual whose innovations are known.
    pub(super) fn log_likelihood_of(&self, residual: &[f64], white: &[f64], observed: &Observed) -> f64 {
        let rows = || residual.iter().zip(white).zip(&observed.kinds);
        let log = |((&residual, &white), &kind): ((&f64, &f64), &Kind)| self.log_density(kind, residual, white);
        if self.half_step > 0.0 || self.outliers.is_some() {
            return rows().map(log).sum();
        }
        let of_intervals: f64 = rows().filter(|(_, kind)| **kind != Kind::Exact).map(log).sum();
        of_intervals + self.exact_log_likelihood(&observed.uncensored(white))
    }

    /// Returns the log-likelihood of innovations, in V, of readings that are not known up to an interval only, without outliers, in
    /// nats.
    pub fn exact_log_likelihood(&self, white: &[f64]) -> f64 {
        let constant = white.len() as f64 * self.constant;
        let variance = self.sigma * self.sigma;
        if self.nu.is_infinite() {
            return constant - 0.5 * dot(white, white) / variance;
        }
        // One logarithm of a product replaces eight; eight factors below 1e38 cannot overflow.
        let narrow = 1.0 / (self.nu * variance);
        let factor = |e: &f64| (1.0 + e * e * narrow).min(1e38);
        let logs: f64 = white.chunks(8).map(|chunk| chunk.iter().map(factor).product::<f64>().ln()).sum();
        constant - 0.5 * (self.nu + 1.0) * logs
    }

    /// Returns the log-likelihood of the rows that are `wanted`, in nats.
    pub fn log_likelihood_where(&self, residual: &[f64], observed: &Observed, wanted: impl Fn(usize) -> bool) -> f64 {
        let white = self.innovations(&observed.errors(residual));
        let rows = (0..residual.len()).filter(|&row| wanted(row));
        rows.map(|row| self.log_density(observed.kinds[row], residual[row], white[row])).sum()
    }

    /// Returns the cost of the law's parameters by Schwarz's criterion, in nats.
    pub fn cost(&self, rows: usize) -> f64 {
        let parameters = (self.autocorrelation.parameter_count() + usize::from(self.nu.is_finite())) as f64;
        0.5 * (rows.max(2) as f64).ln() * parameters
    }
}

/// Returns the logarithm of the normalising constant of Student's t distribution.
fn tail_constant(nu: f64) -> f64 {
    libm::lgamma(0.5 * (nu + 1.0)) - libm::lgamma(0.5 * nu) - 0.5 * (nu * std::f64::consts::PI).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    /// A spring at 98 V reads 100 V in steps of 5 V, whether there is a bound at 100 V or not.
    #[test]
    fn rounded_reading_reaches_a_bound_half_a_step_before_it() {
        let noise = Noise { half_step: 2.5, sigma: 0.2, marginal: 0.2, ..Noise::robust(&normals(100)) };
        for (kind, side) in [(Kind::AtLeast, 1.0), (Kind::AtMost, -1.0)] {
            let log = |residual: f64| noise.log_density(kind, side * residual, side * residual);
            assert!(log(2.0) > 0.9f64.ln(), "{kind:?}: {}", log(2.0));
            assert!(log(3.0) < 0.1f64.ln(), "{kind:?}: {}", log(3.0));
        }
    }

    /// The weight is minus the derivative of the log-density divided by the innovation.
    #[test]
    fn weight_is_the_slope_of_the_log_density() {
        let mut mixture = Noise::robust(&normals(100));
        mixture.outliers = Some((0.05, 8.0));
        for noise in [Noise::robust(&normals(100)), mixture] {
            for e in [0.3, 1.7, -4.0, 11.0] {
                let log = |e| noise.exact_log_density(e);
                let slope = (log(e + 1e-5) - log(e - 1e-5)) / 2e-5;
                let weight = noise.weight(e);
                assert!((slope + weight * e).abs() < 1e-4 * slope.abs(), "{e} {slope} {weight:?}");
            }
        }
    }
}
