//! The contribution of one reading to the likelihood and to the normal equations of a fit.
//!
//! A rounded reading contributes the probability of its quantisation cell, a reading that stopped at a bound the tail
//! probability beyond that bound (a censored observation).

/// `ln(2 pi) / 2`, the constant of the normal log-density.
pub(super) const HALF_LN_TAU: f64 = 0.918_938_533_204_672_7;
/// Half-width of a cell, in standard deviations of the noise, below which the density is taken as constant across the cell.
const NARROW: f64 = 0.05;

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
pub(super) fn in_cell(residual: f64, sigma: f64, half_step: f64) -> Term {
    if half_step < NARROW * sigma {
        // The density hardly changes across it.
        let log = -0.5 * (residual / sigma).powi(2) - HALF_LN_TAU + (2.0 * half_step / sigma).ln();
        return Term { log, residual, weight: 1.0 / (sigma * sigma) };
    }
    // A cell is as likely on either side.
    let side = if residual < 0.0 { -1.0 } else { 1.0 };
    let (a, b) = ((residual.abs() - half_step) / sigma, (residual.abs() + half_step) / sigma);
    if a > 6.0 {
        return Term { log: -0.5 * a * a - a.ln(), residual: side * a * sigma, weight: 1.0 / (sigma * sigma) };
    }
    let probability = (above(a) - above(b)).max(1e-300);
    let score = (density(a) - density(b)) / probability;
    let information = (score * score + (b * density(b) - a * density(a)) / probability).max(1e-3);
    Term { log: probability.ln(), residual: side * sigma * score / information, weight: information / (sigma * sigma) }
}
