//! The contribution of one reading to the likelihood and to the normal equations of a fit.
//!
//! A rounded reading contributes the probability of its quantisation cell, a reading that stopped at a bound the tail
//! probability beyond that bound, one that is known up to an interval the probability of that interval (censored observations).

/// `ln(2 pi) / 2`, the constant of the normal log-density.
pub(super) const HALF_LN_TAU: f64 = 0.918_938_533_204_672_7;
/// Half-width of a cell, in standard deviations of the noise, below which the density is taken as constant across the cell.
const NARROW: f64 = 0.05;

/// The contribution of one row to the normal equations of a fit: `weight (residual - J delta)^2`.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    /// Working residual, in V.
    pub residual: f64,
    /// Weight, in 1/V^2.
    pub weight: f64,
}

fn density(z: f64) -> f64 {
    (-0.5 * z * z - HALF_LN_TAU).exp()
}

/// Returns the probability that a standard normal variable exceeds `z`.
fn above(z: f64) -> f64 {
    0.5 * libm::erfc(z / std::f64::consts::SQRT_2)
}

/// Returns the log-probability of a reading that stopped at an upper bound, `residual` above the prediction, in V, and its term.
pub(super) fn stopped(residual: f64, sigma: f64) -> (f64, Term) {
    let z = residual / sigma;
    if z > 6.0 {
        // The tail probability approaches the density divided by `z`.
        return (-0.5 * z * z - z.ln(), Term { residual, weight: 1.0 / (sigma * sigma) });
    }
    let tail = above(z);
    let hazard = density(z) / tail;
    let information = (hazard * (hazard - z)).max(1e-6);
    (tail.ln(), Term { residual: sigma * hazard / information, weight: information / (sigma * sigma) })
}

/// Returns the log-probability of a reading that was rounded to a cell of the given half-width, in V, up to a constant, and its
/// term.
pub(super) fn in_cell(residual: f64, sigma: f64, half_step: f64) -> (f64, Term) {
    if half_step < NARROW * sigma {
        // The density is nearly constant across the cell.
        let log = -0.5 * (residual / sigma).powi(2) - HALF_LN_TAU + (2.0 * half_step / sigma).ln();
        return (log, Term { residual, weight: 1.0 / (sigma * sigma) });
    }
    // The probability is symmetric.
    let side = if residual < 0.0 { -1.0 } else { 1.0 };
    let (a, b) = ((residual.abs() - half_step) / sigma, (residual.abs() + half_step) / sigma);
    if a > 6.0 {
        return (-0.5 * a * a - a.ln(), Term { residual: side * a * sigma, weight: 1.0 / (sigma * sigma) });
    }
    let probability = (above(a) - above(b)).max(1e-300);
    let score = (density(a) - density(b)) / probability;
    let information = (score * score + (b * density(b) - a * density(a)) / probability).max(1e-3);
    (probability.ln(), Term { residual: side * sigma * score / information, weight: information / (sigma * sigma) })
}

/// Returns log-probability and term of a reading that is an outlier with a probability of `fraction`, from those of a reading that is
/// none and of one that is.
pub(super) fn mixture(fraction: f64, regular: (f64, Term), outlier: (f64, Term)) -> (f64, Term) {
    let logs = [(1.0 - fraction).ln() + regular.0, fraction.ln() + outlier.0];
    let largest = logs[0].max(logs[1]);
    let log = largest + logs.iter().map(|log| (log - largest).exp()).sum::<f64>().ln();
    let [regular, outlier] = [(logs[0], regular.1), (logs[1], outlier.1)].map(|(of, term)| {
        let weight = (of - log).exp() * term.weight;
        (weight, weight * term.residual)
    });
    let weight = (regular.0 + outlier.0).max(f64::MIN_POSITIVE);
    (log, Term { residual: (regular.1 + outlier.1) / weight, weight })
}
