//! Constants and quantiles that several parts of the campaign need.

/// One-sided 95 % point of the standard normal distribution.
pub const NORMAL_95: f64 = 1.6449;

/// Quantile of the values at `part` from 0 to 1, by the nearest rank; `None` without values.
pub fn quantile(values: &[f64], part: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    Some(sorted[(part * last as f64).round() as usize])
}
