//! Scales of values: of residuals, and of what changes from row to row.

use crate::stats::median::deviation;
use crate::stats::sums::dot;

/// 97.5 % quantile of the standard normal distribution: half the width of a 95 % interval, in standard deviations.
pub const Z: f64 = 1.96;
/// No reading is taken to be better than this, in V: the tick itself says no more, and a record without noise, as another
/// simulation writes it, differs from ours by the steps in which both were computed.
pub const FINEST_V: f64 = 0.01;

/// Robust scale around zero: the median size, as a normal's standard deviation, [`FINEST_V`] at least. Noise is never exactly
/// zero; rows that are (a spring at rest, read without noise) say nothing of it.
pub fn scale(residual: &[f64]) -> f64 {
    deviation(residual.iter().copied().filter(|r| *r != 0.0)).map_or(FINEST_V, |scale| scale.max(FINEST_V))
}

/// True if what is left is the arithmetic's.
pub fn negligible(residual: &[f64]) -> bool {
    scale_of_squares(residual) <= FINEST_V
}

/// Root of the mean square.
pub fn scale_of_squares(residual: &[f64]) -> f64 {
    (dot(residual, residual) / residual.len().max(1) as f64).sqrt()
}

/// Second differences, as large as independent noise: a slow signal has none.
pub(crate) fn bends(reading: &[f64]) -> impl Iterator<Item = f64> {
    reading.windows(3).map(|three| (three[0] - 2.0 * three[1] + three[2]) / 6f64.sqrt())
}

/// Independent numbers, nearly normal: sums of twelve of splitmix64's.
#[cfg(test)]
pub(crate) fn normals(rows: usize) -> Vec<f64> {
    let mut state = 20_261_121u64;
    let mut uniform = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..rows).map(|_| (0..12).map(|_| uniform() - 0.5).sum()).collect()
}
