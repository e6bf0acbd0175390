//! What a reading that was rounded, or that stopped at a bound, says of the noise: the probability of its cell.

use crate::noise::tail::sizes;
use crate::noise::{HALF_LN_TAU, Noise, Term, exact};
use crate::record::observed::{Kind, Observed};
use crate::stats::scale::{FINEST_V, scale_of_squares};
use crate::stats::sums::total;

/// Half a cell, in scales of the noise, from which on it is a point.
const NARROW: f64 = 0.05;

impl Noise {
    /// The scale under which rounded readings are likeliest: golden section on its logarithm.
    pub(super) fn rescale_cells(&mut self, residual: &[f64], observed: &Observed) {
        let in_cells = sizes(&exact(residual, observed), 0.5 * self.cell.max(scale_of_squares(residual)));
        let rows = || residual.iter().zip(&observed.kinds);
        let stopped: Vec<(f64, Kind)> =
            rows().filter(|(_, kind)| **kind != Kind::Exact).map(|(&residual, &kind)| (residual, kind)).collect();
        let log = |ln_sigma: f64| -> f64 {
            let noise = Self { sigma: ln_sigma.exp(), marginal: ln_sigma.exp(), ..self.clone() };
            let at_bound: f64 = stopped.iter().map(|&(r, kind)| noise.term(kind, r, r).log).sum();
            at_bound + total(&in_cells, |&(r, times)| times * in_cell(r, noise.sigma, noise.cell).log)
        };
        let (mut low, mut high) =
            ((0.02 * self.cell).max(FINEST_V).ln(), (scale_of_squares(residual) + self.cell).ln());
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

fn density(z: f64) -> f64 {
    (-0.5 * z * z - HALF_LN_TAU).exp()
}

/// Probability above `z`.
fn above(z: f64) -> f64 {
    0.5 * libm::erfc(z / std::f64::consts::SQRT_2)
}

/// A reading that stopped at a bound, which is `residual` above the prediction.
pub(super) fn stopped(residual: f64, sigma: f64) -> Term {
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
pub(super) fn in_cell(residual: f64, sigma: f64, half: f64) -> Term {
    if half < NARROW * sigma {
        // The density hardly changes across it.
        let log = -0.5 * (residual / sigma).powi(2) - HALF_LN_TAU + (2.0 * half / sigma).ln();
        return Term { log, residual, weight: 1.0 / (sigma * sigma) };
    }
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
