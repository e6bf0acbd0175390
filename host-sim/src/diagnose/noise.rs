//! What the noise is, given what a model leaves: its memory, its scale, its tail.
//!
//! ```text
//! r[i] = sum phi[k] r[i-k] + e[i],      e ~ Student t of scale sigma and nu degrees of freedom (normal for nu = inf)
//!                                       or a mixture: a few readings with a much wider normal
//! ```
//!
//! Without the autoregression, coloured noise passes for structure; without the heavy tail, a few readings do. Orders
//! are chosen by Schwarz's criterion. Rounded and stopped readings have the probability of their cell.

use super::observed::{Kind, Observed};

/// The law of the noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Scale of the innovations, in V.
    pub sigma: f64,
    /// Degrees of freedom of the tail.
    pub nu: f64,
    /// Autoregression, lag 1 first.
    pub ar: Vec<f64>,
    /// Fraction of outliers, and their scale in V.
    pub wide: Option<(f64, f64)>,
    /// Half of the readings' step, where it is coarse beside the noise, in V.
    pub cell: f64,
    /// Scale of the residual itself, in V.
    pub marginal: f64,
    /// What of a row's log-density its residual does not change.
    constant: f64,
}

/// Longest memory that is looked for, in rows.
const LONGEST_MEMORY: usize = 50;
/// Shorter records have no memory that could be told from structure.
const ROWS_FOR_MEMORY: usize = 150;
/// A step coarser than this many of the noise's scales is a cell, a finer one is noise.
pub const COARSE: f64 = 2.0;
const TAILS: [f64; 6] = [2.3, 3.0, 4.0, 6.0, 10.0, 25.0];
/// What a mixture must be better by than one heavy tail, in nats, to be outliers.
const OUTLIERS: f64 = 7.0;
/// Scale of outliers in the noise's scales, at least.
const WIDE: f64 = 4.0;

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
        let noise = Self { sigma, nu: 5.0, ar: Vec::new(), wide: None, cell: 0.0, marginal: sigma, constant: 0.0 };
        noise.with_tail(5.0, sigma)
    }

    /// The same with another tail and scale.
    fn with_tail(&self, nu: f64, sigma: f64) -> Self {
        let shape = if nu.is_finite() { tail_constant(nu) } else { -HALF_LN_TAU };
        Self { nu, sigma, wide: None, constant: shape - sigma.ln(), ..self.clone() }
    }

    /// The law that suits what a model leaves.
    pub fn fitted(residual: &[f64], observed: &Observed) -> Self {
        let residual = &*observed.errors(residual);
        let mut noise = Self::robust(&exact(residual, observed));
        if let Some(step) = observed.step
            && step >= COARSE * rest_of(scale_of_squares(residual), step)
        {
            noise.cell = step / 2.0;
            noise.nu = f64::INFINITY;
            noise.sigma = rest_of(scale_of_squares(residual), step).max(0.05 * step);
            noise.rescale_cells(residual, observed);
            noise.marginal = noise.sigma;
            return noise;
        }
        noise.ar = memory(residual, noise.sigma);
        let innovations: Vec<f64> = exact(&noise.whitened(residual), observed);
        noise.fit_tail(&innovations);
        noise.marginal = scale_of_squares(&exact(residual, observed)).max(noise.sigma);
        noise
    }

    /// The same law with the scale that suits a residual.
    pub fn rescaled(&self, residual: &[f64], observed: &Observed) -> Self {
        let residual = &*observed.errors(residual);
        let mut noise = self.clone();
        if noise.cell > 0.0 {
            noise.rescale_cells(residual, observed);
        } else {
            let innovations = exact(&noise.whitened(residual), observed);
            let sigma = tail_scale(&innovations, self.nu, scale(&innovations).max(1e-9), 3);
            noise = self.with_tail(self.nu, sigma);
            noise.marginal *= sigma / self.sigma;
        }
        noise
    }

    /// Innovations: what the noise's memory does not foretell.
    pub fn whitened(&self, residual: &[f64]) -> Vec<f64> {
        let mut white = residual.to_vec();
        for (lag, phi) in (1..).zip(&self.ar) {
            for (white, earlier) in white[lag.min(residual.len())..].iter_mut().zip(residual) {
                *white -= phi * earlier;
            }
        }
        white
    }

    /// The part of a row in a fit: `residual` as it is, `innovation` whitened.
    pub fn term(&self, kind: Kind, residual: f64, innovation: f64) -> Term {
        match kind {
            Kind::AtLeast => stopped(residual, self.marginal),
            Kind::AtMost => {
                let term = stopped(-residual, self.marginal);
                Term { residual: -term.residual, ..term }
            }
            Kind::Exact if self.cell > 0.0 => in_cell(residual, self.sigma, self.cell),
            Kind::Exact => self.exact_term(innovation),
        }
    }

    fn exact_term(&self, e: f64) -> Term {
        let variance = self.sigma * self.sigma;
        if let Some((fraction, wide)) = self.wide {
            let normal = |scale: f64| (-0.5 * (e / scale).powi(2)).exp() / scale;
            let (narrow, far) = ((1.0 - fraction) * normal(self.sigma), fraction * normal(wide));
            let sum = (narrow + far).max(1e-300);
            let weight = (narrow / variance + far / (wide * wide)) / sum;
            return Term { log: sum.ln() - HALF_LN_TAU, residual: e, weight };
        }
        if self.nu.is_infinite() {
            return Term { log: self.constant - 0.5 * e * e / variance, residual: e, weight: 1.0 / variance };
        }
        let nu = self.nu;
        let log = self.constant - 0.5 * (nu + 1.0) * (e * e / (nu * variance)).ln_1p();
        Term { log, residual: e, weight: (nu + 1.0) / (nu * variance + e * e) }
    }

    /// Log-likelihood of all rows.
    pub fn log_likelihood(&self, residual: &[f64], observed: &Observed) -> f64 {
        let plain = self.cell == 0.0 && self.wide.is_none() && observed.all_exact();
        if !plain {
            return self.logs(residual, observed).sum();
        }
        let white = self.whitened(residual);
        let count = white.len() as f64 * self.constant;
        let variance = self.sigma * self.sigma;
        if self.nu.is_infinite() {
            return count - 0.5 * white.iter().map(|e| e * e).sum::<f64>() / variance;
        }
        // The logarithm of a product is dear once, not eight times; eight factors cannot overflow below 1e38 each.
        let factor = |e: &f64| (1.0 + e * e / (self.nu * variance)).min(1e38);
        let logs: f64 = white.chunks(8).map(|chunk| chunk.iter().map(factor).product::<f64>().ln()).sum();
        count - 0.5 * (self.nu + 1.0) * logs
    }

    /// Log-likelihood of each row.
    pub fn logs<'a>(&'a self, residual: &'a [f64], observed: &'a Observed) -> impl Iterator<Item = f64> + 'a {
        let white = self.whitened(&observed.errors(residual));
        (0..residual.len()).map(move |row| self.term(observed.kinds[row], residual[row], white[row]).log)
    }

    /// What its parameters cost by Schwarz's criterion, in nats.
    pub fn cost(&self, rows: usize) -> f64 {
        let parameters = self.ar.len() as f64 + f64::from(u8::from(self.nu.is_finite()));
        0.5 * (rows.max(2) as f64).ln() * parameters
    }

    /// How much more the innovations' means over long stretches vary than independent ones would; 1 unless significant.
    ///
    /// Noise that grows towards low frequencies has no finite memory: after any autoregression slow swings remain, and
    /// they pass for a shift or a drift.
    pub fn long_memory(&self, errors: &[f64]) -> f64 {
        let bound = 4.0 * self.sigma;
        let white: Vec<f64> = self.whitened(errors).into_iter().map(|e| e.clamp(-bound, bound)).collect();
        let variance = white.iter().map(|e| e * e).sum::<f64>() / white.len().max(1) as f64;
        let mut most = 1.0f64;
        for parts in [5, 10, 20, 40, 80] {
            let length = white.len() / parts;
            if length < 5 || variance <= 0.0 {
                continue;
            }
            let squares = white.chunks_exact(length).map(|chunk| chunk.iter().sum::<f64>().powi(2) / length as f64);
            let ratio = squares.take(parts).sum::<f64>() / parts as f64 / variance;
            if ratio > 1.0 + 2.0 * (2.0 / parts as f64).sqrt() {
                most = most.max(ratio);
            }
        }
        most
    }

    fn fit_tail(&mut self, innovations: &[f64]) {
        let start = scale(innovations).max(1e-9);
        let mut best = f64::NEG_INFINITY;
        let mut consider = |noise: &mut Self, tried: Self, cost: f64| {
            let log: f64 = innovations.iter().map(|&e| tried.exact_term(e).log).sum::<f64>() - cost;
            if log > best {
                best = log;
                *noise = tried;
            }
        };
        let normal = self.with_tail(f64::INFINITY, scale_of_squares(innovations).max(1e-9));
        consider(self, normal.clone(), 0.0);
        for nu in TAILS {
            let sigma = tail_scale(innovations, nu, start, 8);
            consider(self, normal.with_tail(nu, sigma), 2.0);
        }
        let far = innovations.iter().filter(|e| e.abs() > WIDE * start).count();
        if far >= 2 && innovations.len() >= 30 {
            let mixture = Self::mixture(innovations, start, &normal);
            consider(self, mixture, OUTLIERS);
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
            sigma = (narrow_sum / (count - weight)).sqrt().max(1e-9);
            wide = (wide_sum / weight.max(1e-9)).sqrt().max(WIDE * sigma);
        }
        Self { wide: Some((fraction, wide)), ..normal.with_tail(f64::INFINITY, sigma) }
    }

    /// The scale under which rounded readings are likeliest: golden section on its logarithm.
    fn rescale_cells(&mut self, residual: &[f64], observed: &Observed) {
        let log = |ln_sigma: f64| -> f64 {
            let noise = Self { sigma: ln_sigma.exp(), marginal: ln_sigma.exp(), ..self.clone() };
            residual.iter().zip(&observed.kinds).map(|(&r, &kind)| noise.term(kind, r, r).log).sum()
        };
        let (mut low, mut high) = ((0.02 * self.cell).ln(), (scale_of_squares(residual) + self.cell).ln());
        const GOLDEN: f64 = 0.618_033_988_75;
        for _ in 0..12 {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            if log(a) > log(b) {
                high = b;
            } else {
                low = a;
            }
        }
        self.sigma = (0.5 * (low + high)).exp();
        self.marginal = self.sigma;
    }
}

const HALF_LN_TAU: f64 = 0.918_938_533_204_672_7;

/// Logarithm of the t distribution's constant.
fn tail_constant(nu: f64) -> f64 {
    libm::lgamma(0.5 * (nu + 1.0)) - libm::lgamma(0.5 * nu) - 0.5 * (nu * std::f64::consts::PI).ln()
}

/// What is left of a scale when rounding to a step is taken off, in V.
fn rest_of(scale: f64, step: f64) -> f64 {
    (scale * scale - step * step / 12.0).max(0.0).sqrt()
}

/// Innovations of rows that were read as they are.
fn exact(innovations: &[f64], observed: &Observed) -> Vec<f64> {
    innovations.iter().zip(&observed.kinds).filter(|(_, kind)| **kind == Kind::Exact).map(|(e, _)| *e).collect()
}

/// Robust scale around zero: the median size, as a normal's standard deviation.
pub fn scale(residual: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = residual.iter().map(|r| r.abs()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    (*median / 0.6745).max(1e-9)
}

/// Root of the mean square.
pub fn scale_of_squares(residual: &[f64]) -> f64 {
    (residual.iter().map(|r| r * r).sum::<f64>() / residual.len().max(1) as f64).sqrt()
}

/// Likeliest scale of a t distribution, by reweighting.
fn tail_scale(innovations: &[f64], nu: f64, start: f64, rounds: usize) -> f64 {
    if nu.is_infinite() {
        return scale_of_squares(innovations).max(1e-9);
    }
    let mut variance = start * start;
    for _ in 0..rounds {
        let sum: f64 = innovations.iter().map(|e| (nu + 1.0) * e * e / (nu + e * e / variance)).sum();
        variance = (sum / innovations.len().max(1) as f64).max(1e-18);
    }
    variance.sqrt()
}

/// Autoregression of a residual by Levinson's recursion, its order by Schwarz's criterion.
fn memory(residual: &[f64], scale: f64) -> Vec<f64> {
    let rows = residual.len();
    if rows < ROWS_FOR_MEMORY {
        return Vec::new();
    }
    let clipped: Vec<f64> = residual.iter().map(|r| r.clamp(-4.0 * scale, 4.0 * scale)).collect();
    let correlation: Vec<f64> = (0..=LONGEST_MEMORY)
        .map(|lag| clipped.iter().zip(&clipped[lag..]).map(|(a, b)| a * b).sum::<f64>() / rows as f64)
        .collect();
    let mut error = correlation[0];
    if error <= 0.0 {
        return Vec::new();
    }
    let price = (rows as f64).ln();
    let (mut phi, mut best, mut best_value) = (Vec::new(), Vec::new(), rows as f64 * error.ln());
    for order in 1..=LONGEST_MEMORY {
        let ahead: f64 = phi.iter().enumerate().map(|(k, p)| p * correlation[order - 1 - k]).sum();
        let reflection = (correlation[order] - ahead) / error;
        let reversed: Vec<f64> = phi.iter().rev().copied().collect();
        phi.iter_mut().zip(&reversed).for_each(|(p, r)| *p -= reflection * r);
        phi.push(reflection);
        error *= 1.0 - reflection * reflection;
        let value = rows as f64 * error.max(1e-300).ln() + price * order as f64;
        if value < best_value {
            (best, best_value) = (phi.clone(), value);
        }
    }
    best
}

fn density(z: f64) -> f64 {
    (-0.5 * z * z - HALF_LN_TAU).exp()
}

/// Probability above `z`.
fn above(z: f64) -> f64 {
    0.5 * libm::erfc(z / std::f64::consts::SQRT_2)
}

/// A reading that stopped at a bound, which is `residual` above the prediction.
fn stopped(residual: f64, sigma: f64) -> Term {
    let z = residual / sigma;
    if z > 6.0 {
        // Far below the bound the tail is nearly a normal's own.
        return Term { log: -0.5 * z * z - z.ln(), residual, weight: 1.0 / (sigma * sigma) };
    }
    let tail = above(z);
    let hazard = density(z) / tail;
    let information = (hazard * (hazard - z)).max(1e-6);
    Term { log: tail.ln(), residual: sigma * hazard / information, weight: information / (sigma * sigma) }
}

/// A reading that was rounded to a cell.
fn in_cell(residual: f64, sigma: f64, half: f64) -> Term {
    // A cell is as likely on either side.
    let side = if residual < 0.0 { -1.0 } else { 1.0 };
    let (a, b) = ((residual.abs() - half) / sigma, (residual.abs() + half) / sigma);
    if a > 6.0 {
        return Term { log: -0.5 * a * a - a.ln(), residual: side * a * sigma, weight: 1.0 / (sigma * sigma) };
    }
    let probability = (above(a) - above(b)).max(1e-300);
    let score = (density(a) - density(b)) / probability;
    let information = (score * score + (b * density(b) - a * density(a)) / probability).max(1e-3);
    Term { log: probability.ln(), residual: side * sigma * score / information, weight: information / (sigma * sigma) }
}
