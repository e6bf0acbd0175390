//! What the noise is, given what a model leaves: its memory, its scale, its tail.
//!
//! ```text
//! memory(weight r) = e,      e ~ Student t of scale sigma and nu degrees of freedom (normal for nu = inf)
//!                     or a mixture: a few readings with a much wider normal
//! ```
//!
//! Without the autoregression, coloured noise passes for structure; without the heavy tail, a few readings do. Orders
//! are chosen by Schwarz's criterion. Rounded and stopped readings have the probability of their cell. Weights are those of
//! noise that grows with the reading (`growth`); for any other they are 1.

use std::borrow::Cow;
use std::sync::Arc;

pub mod memory;
mod octaves;
mod reading;
mod tail;

pub use memory::Memory;

use crate::record::observed::{COARSE, Kind, Observed};
use crate::record::quantisation_grid::Lattice;
use crate::stats::scale::{FINEST_V, negligible, scale, scale_of_squares};
use crate::stats::sums::dot;
use reading::{in_cell, stopped};
use tail::tail_constant;

/// The law of the noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Scale of the innovations, in V.
    pub sigma: f64,
    /// Degrees of freedom of the tail.
    pub nu: f64,
    /// What earlier errors foretell.
    pub memory: Memory,
    /// Fraction of outliers, and their scale in V.
    pub wide: Option<(f64, f64)>,
    /// Half of the readings' step, where it is coarse beside the noise, in V.
    pub cell: f64,
    /// Scale of the residual itself, in V.
    pub marginal: f64,
    /// One over each row's scale, their geometric mean 1.
    weights: Option<Arc<[f64]>>,
    /// What of a row's log-density its residual does not change.
    constant: f64,
}

/// One row's part in a fit: `weight (residual - J delta)^2`.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    /// Log-probability, up to what no parameter changes.
    pub log: f64,
    /// Working residual, in V.
    pub residual: f64,
    /// 1/V^2
    pub weight: f64,
}

impl Noise {
    /// Independent, with a moderately heavy tail, of any scale: for a first look at anything.
    pub fn first_look() -> Self {
        Self::robust(&[1.0])
    }

    /// As [`Noise::first_look`], with the scale of a residual.
    pub fn robust(residual: &[f64]) -> Self {
        let sigma = scale(residual);
        let noise = Self {
            sigma,
            nu: 5.0,
            memory: Memory::default(),
            wide: None,
            cell: 0.0,
            marginal: sigma,
            weights: None,
            constant: 0.0,
        };
        noise.with_tail(5.0, sigma)
    }

    /// The same with another tail and scale, [`FINEST_V`] at least.
    fn with_tail(&self, nu: f64, sigma: f64) -> Self {
        let sigma = sigma.max(FINEST_V);
        let shape = if nu.is_finite() { tail_constant(nu) } else { -HALF_LN_TAU };
        Self { nu, sigma, constant: shape - sigma.ln(), ..self.clone() }
    }

    /// The law that suits what a model leaves.
    pub fn fitted(residual: &[f64], observed: &Observed) -> Self {
        let residual = &*observed.errors(residual);
        let mut noise = Self::robust(&exact(residual, observed));
        if let Some(Lattice { step, .. }) = observed.lattice
            && (observed.step_beyond(COARSE).is_some()
                || step >= COARSE * rest_of(scale_of_squares(residual), step).max(FINEST_V))
        {
            noise.cell = step / 2.0;
            noise.nu = f64::INFINITY;
            noise.sigma = rest_of(scale_of_squares(residual), step).max(0.05 * step).max(FINEST_V);
            noise.rescale_cells(residual, observed);
            noise.marginal = noise.sigma;
            return noise;
        }
        if negligible(residual) {
            return noise.with_tail(f64::INFINITY, FINEST_V);
        }
        noise.weights.clone_from(&observed.weights);
        let even = noise.weighted(residual);
        let robust = if noise.weights.is_some() { scale(&exact(&even, observed)) } else { noise.sigma };
        noise.memory = Memory::fitted(&even, robust);
        let innovations = noise.memory.innovations(&even);
        noise.fit_tail(&exact(&innovations, observed));
        if noise.wide.is_none() {
            let white = noise.whitened(residual);
            // Mostly nothing is wild, and they are the same.
            if white != innovations {
                noise.fit_tail(&exact(&white, observed));
            }
        }
        if !noise.memory.is_none() && noise.nu.is_finite() {
            // Squares chose it, of errors that were clipped; where the tail is heavy, the likelihood may not want it.
            let mut alone = Self { memory: Memory::default(), ..noise.clone() };
            alone.fit_tail(&exact(&even, observed));
            let worth = |noise: &Self| noise.log_likelihood(residual, observed) - noise.cost(residual.len());
            if worth(&alone) > worth(&noise) {
                noise = alone;
            }
        }
        noise.marginal = scale_of_squares(&exact(residual, observed)).max(noise.sigma);
        noise
    }

    /// The same law with the scale that suits a residual, and the log-likelihood of all rows under it.
    pub fn rescaled(&self, residual: &[f64], observed: &Observed) -> (Self, f64) {
        let errors = &*observed.errors(residual);
        let white = self.innovations(errors);
        let mut noise = self.clone();
        if noise.cell > 0.0 {
            noise.rescale_cells(errors, observed);
        } else {
            let exact = exact(&white, observed);
            noise.fit_scale(noise.first_scale(&exact), &exact, |&e| (e, 1.0), 3);
            noise.marginal *= noise.sigma / self.sigma;
        }
        let value = noise.log_of(residual, &white, observed);
        (noise, value)
    }

    /// What is not seen in it, in V, however many rows show it.
    pub fn floor_v(&self) -> f64 {
        self.marginal.max(self.cell)
    }

    /// What the noise's memory does not foretell.
    pub fn whitened(&self, change: &[f64]) -> Vec<f64> {
        self.memory.whitened(&self.weighted(change))
    }

    /// The same of a residual: its outliers foretell nothing.
    pub fn innovations(&self, residual: &[f64]) -> Vec<f64> {
        if self.wide.is_some() { self.memory.innovations(&self.weighted(residual)) } else { self.whitened(residual) }
    }

    /// As if the noise were even.
    pub fn weighted<'v>(&self, values: &'v [f64]) -> Cow<'v, [f64]> {
        match &self.weights {
            None => Cow::Borrowed(values),
            Some(weights) => values.iter().zip(&**weights).map(|(value, weight)| value * weight).collect(),
        }
    }

    /// The part of a row in a fit: `residual` as it is, `innovation` whitened.
    pub fn term(&self, kind: Kind, residual: f64, innovation: f64) -> Term {
        match kind {
            // What is rounded comes to a bound from half a step before it.
            Kind::AtLeast => stopped(residual - self.cell, self.marginal),
            Kind::AtMost => {
                let term = stopped(-residual - self.cell, self.marginal);
                Term { residual: -term.residual, ..term }
            }
            Kind::Exact if self.cell > 0.0 => in_cell(residual, self.sigma, self.cell),
            Kind::Exact => self.exact_term(innovation),
        }
    }

    fn exact_term(&self, e: f64) -> Term {
        let log = match self.wide {
            Some(_) => self.densities(e).iter().sum::<f64>().max(1e-300).ln() - HALF_LN_TAU,
            None if self.nu.is_infinite() => self.constant - 0.5 * (e / self.sigma).powi(2),
            None => self.constant - 0.5 * (self.nu + 1.0) * ((e / self.sigma).powi(2) / self.nu).ln_1p(),
        };
        Term { log, residual: e, weight: self.weight(e) }
    }

    /// Minus the slope of the log-density over the innovation, in 1/V^2.
    fn weight(&self, e: f64) -> f64 {
        let variance = self.sigma * self.sigma;
        if let Some((_, wide)) = self.wide {
            let [narrow, far] = self.densities(e);
            return (narrow / variance + far / (wide * wide)) / (narrow + far).max(1e-300);
        }
        if self.nu.is_infinite() {
            return 1.0 / variance;
        }
        (self.nu + 1.0) / (self.nu * variance + e * e)
    }

    /// Of a usual reading and of an outlier, less a constant.
    fn densities(&self, e: f64) -> [f64; 2] {
        let (fraction, wide) = self.wide.unwrap_or((0.0, self.sigma));
        let normal = |scale: f64| (-0.5 * (e / scale).powi(2)).exp() / scale;
        [(1.0 - fraction) * normal(self.sigma), fraction * normal(wide)]
    }

    /// Log-likelihood of all rows.
    pub fn log_likelihood(&self, residual: &[f64], observed: &Observed) -> f64 {
        self.log_of(residual, &self.innovations(&observed.errors(residual)), observed)
    }

    /// The same, of a residual that is whitened already.
    fn log_of(&self, residual: &[f64], white: &[f64], observed: &Observed) -> f64 {
        let plain = self.cell == 0.0 && self.wide.is_none() && observed.all_exact();
        if !plain {
            let logs = residual.iter().zip(white).zip(&observed.kinds);
            return logs.map(|((&residual, &white), &kind)| self.term(kind, residual, white).log).sum();
        }
        let count = white.len() as f64 * self.constant;
        let variance = self.sigma * self.sigma;
        if self.nu.is_infinite() {
            return count - 0.5 * dot(white, white) / variance;
        }
        // The logarithm of a product is dear once, not eight times; eight factors cannot overflow below 1e38 each.
        let narrow = 1.0 / (self.nu * variance);
        let factor = |e: &f64| (1.0 + e * e * narrow).min(1e38);
        let logs: f64 = white.chunks(8).map(|chunk| chunk.iter().map(factor).product::<f64>().ln()).sum();
        count - 0.5 * (self.nu + 1.0) * logs
    }

    /// Log-likelihood of each row.
    pub fn logs<'a>(&'a self, residual: &'a [f64], observed: &'a Observed) -> impl Iterator<Item = f64> + 'a {
        let white = self.innovations(&observed.errors(residual));
        (0..residual.len()).map(move |row| self.term(observed.kinds[row], residual[row], white[row]).log)
    }

    /// What its parameters cost by Schwarz's criterion, in nats.
    pub fn cost(&self, rows: usize) -> f64 {
        let parameters = (self.memory.parameters() + usize::from(self.nu.is_finite())) as f64;
        0.5 * (rows.max(2) as f64).ln() * parameters
    }
}

const HALF_LN_TAU: f64 = 0.918_938_533_204_672_7;

/// What is left of a scale when rounding to a step is taken off, in V.
fn rest_of(scale: f64, step: f64) -> f64 {
    (scale * scale - step * step / 12.0).max(0.0).sqrt()
}

/// Innovations of rows that were read as they are.
fn exact<'i>(innovations: &'i [f64], observed: &Observed) -> Cow<'i, [f64]> {
    if observed.all_exact() {
        return Cow::Borrowed(innovations);
    }
    innovations.iter().zip(&observed.kinds).filter(|(_, kind)| **kind == Kind::Exact).map(|(e, _)| *e).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    fn as_read(rows: usize) -> Observed {
        Observed {
            kinds: vec![Kind::Exact; rows],
            lattice: None,
            upper: None,
            lower: None,
            scatter_v: 1.0,
            cut_v: 0.0,
            weights: None,
        }
    }

    /// A normal over the root of a chi-square over its four degrees of freedom: Student's t.
    fn heavy(rows: usize) -> Vec<f64> {
        let student = |five: &[f64]| five[0] / (five[1..].iter().map(|x| x * x).sum::<f64>() / 4.0).sqrt();
        normals(5 * rows).chunks(5).map(student).collect()
    }

    /// A memory that squares see by chance would make room for whatever does without it.
    #[test]
    fn independent_noise_of_a_heavy_tail_remembers_nothing() {
        let remembers = |rows: &&[f64]| !Noise::fitted(rows, &as_read(rows.len())).memory.is_none();
        let count = heavy(60_000).chunks(600).filter(remembers).count();
        assert!(count < 2, "{count} of 100");
    }

    #[test]
    fn a_tail_is_recovered() {
        let normal = normals(4000);
        let noise = Noise::fitted(&normal, &as_read(4000));
        assert!(noise.nu.is_infinite() && (noise.sigma - 1.0).abs() < 0.05, "{noise:?}");
        let noise = Noise::fitted(&heavy(4000), &as_read(4000));
        assert!((3.0..=6.0).contains(&noise.nu) && (noise.sigma - 1.0).abs() < 0.1, "{noise:?}");
    }

    #[test]
    fn outliers_are_a_mixture_and_one_wild_reading_is_one() {
        let mut readings = normals(2000);
        readings[700] = 1e6;
        let noise = Noise::fitted(&readings, &as_read(2000));
        assert!(noise.wide.is_some_and(|(fraction, _)| fraction < 0.002), "{noise:?}");
        assert!((noise.sigma - 1.0).abs() < 0.05, "{noise:?}");
        readings[700] = 0.0;
        readings.iter_mut().step_by(50).for_each(|reading| *reading += 12.0);
        let noise = Noise::fitted(&readings, &as_read(2000));
        assert!(noise.wide.is_some_and(|(fraction, _)| (0.01..0.04).contains(&fraction)), "{noise:?}");
    }

    #[test]
    fn rounding_is_taken_off_the_scale() {
        let step = 5.0;
        let off: Vec<f64> = normals(3000)
            .iter()
            .enumerate()
            .map(|(row, noise)| {
                // Wherever in a cell the truth lies.
                let truth = 0.37 * row as f64;
                ((truth + noise) / step).round() * step - truth
            })
            .collect();
        let noise =
            Noise::fitted(&off, &Observed { lattice: Some(Lattice { step, low: step, high: step }), ..as_read(3000) });
        assert!(noise.cell == 2.5 && (noise.sigma - 1.0).abs() < 0.1, "{noise:?}");
    }

    /// A spring at 98 V reads 100 V in steps of 5 V, whether or not it stops there.
    #[test]
    fn what_is_rounded_comes_to_a_bound_from_half_a_step_before_it() {
        let noise = Noise { cell: 2.5, sigma: 0.2, marginal: 0.2, ..Noise::robust(&normals(100)) };
        for (kind, side) in [(Kind::AtLeast, 1.0), (Kind::AtMost, -1.0)] {
            let log = |residual: f64| noise.term(kind, side * residual, side * residual).log;
            assert!(log(2.0) > 0.9f64.ln(), "{kind:?}: {}", log(2.0));
            assert!(log(3.0) < 0.1f64.ln(), "{kind:?}: {}", log(3.0));
        }
    }

    /// The weight is minus the slope of the log-density over the innovation.
    #[test]
    fn a_weight_is_the_slope_of_its_density() {
        let mut mixture = Noise::robust(&normals(100));
        mixture.wide = Some((0.05, 8.0));
        for noise in [Noise::robust(&normals(100)), mixture] {
            for e in [0.3, 1.7, -4.0, 11.0] {
                let log = |e| noise.exact_term(e).log;
                let slope = (log(e + 1e-5) - log(e - 1e-5)) / 2e-5;
                let term = noise.exact_term(e);
                assert!((slope + term.weight * e).abs() < 1e-4 * slope.abs(), "{e} {slope} {term:?}");
            }
        }
    }
}
