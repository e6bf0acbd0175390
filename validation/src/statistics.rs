//! Constants, quantiles and sums that several modules need.

/// One-sided 95 % point of the standard normal distribution.
pub const NORMAL_95: f64 = 1.6449;

/// Two-sided 95 % point of the standard normal distribution.
const NORMAL_975: f64 = 1.96;

/// 95 % interval of a probability by Wilson's score test, from the number of successes among `count` independent trials; 0 to 1
/// without a trial.
pub fn wilson(successes: usize, count: usize) -> [f64; 2] {
    if count == 0 {
        return [0.0, 1.0];
    }
    let (n, z2) = (count as f64, NORMAL_975 * NORMAL_975);
    let part = successes as f64 / n;
    let centre = (part + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = NORMAL_975 / (1.0 + z2 / n) * (part * (1.0 - part) / n + z2 / (4.0 * n * n)).sqrt();
    [(centre - half).max(0.0), (centre + half).min(1.0)]
}

/// Sum of the products of two vectors' elements.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Median of the values, the upper of two; `None` without values.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// Quantile of the values at `part` from 0 to 1, by the nearest rank; `None` without values.
pub fn quantile(values: &[f64], part: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    Some(sorted[(part * last as f64).round() as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_intervals_are_those_of_the_formula() {
        // 8 of 10: Agresti, Coull, Am. Stat. 52, 1998.
        let [low, high] = wilson(8, 10);
        assert!((low - 0.490).abs() < 1e-3 && (high - 0.943).abs() < 1e-3, "{low} {high}");
        let [low, high] = wilson(20, 20);
        assert!((low - 0.839).abs() < 1e-3 && high > 0.999_999, "{low} {high}");
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
    }
}
