//! Medians and scales derived from them, which outliers hardly change.

/// Median of the absolute value of a standard normal variable.
const NORMAL_MEDIAN_SIZE: f64 = 0.6745;
/// Number of neighbours on each side of a row in a running median.
const NEIGHBOURS: usize = 2;

/// Returns the upper median of the values, and reorders them; `None` if there are none.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Returns the standard deviation of the zero-mean normal distribution whose median absolute value is that of the
/// values, in their unit; `None` if there are none.
pub(crate) fn robust_deviation(values: impl Iterator<Item = f64>) -> Option<f64> {
    // Positive numbers are ordered as their bits, which are compared faster.
    let mut sizes = Vec::with_capacity(values.size_hint().1.unwrap_or(0));
    sizes.extend(values.map(|value| value.abs().to_bits()));
    let middle = sizes.len() / 2;
    (!sizes.is_empty()).then(|| f64::from_bits(*sizes.select_nth_unstable(middle).1) / NORMAL_MEDIAN_SIZE)
}

/// Returns the median of each row and its two neighbours on each side; the first two rows take the median of the first
/// five values, the last two that of the last five. Needs at least five values.
pub(crate) fn running_median(values: &[f64]) -> Vec<f64> {
    let of_row = |row: usize| {
        let first = row.saturating_sub(NEIGHBOURS).min(values.len() - 2 * NEIGHBOURS - 1);
        let mut around: [f64; 2 * NEIGHBOURS + 1] = std::array::from_fn(|k| values[first + k]);
        *around.select_nth_unstable_by(NEIGHBOURS, f64::total_cmp).1
    };
    (0..values.len()).map(of_row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_do_not_change_medians() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [3.0, 1e9, 1.0]), Some(3.0));
        assert_eq!(robust_deviation([-0.6745, 1e9, 0.1].into_iter()), Some(1.0));
        assert_eq!(running_median(&[1.0, 2.0, 1e9, 4.0, 5.0, 6.0]), [4.0, 4.0, 4.0, 5.0, 5.0, 5.0]);
    }
}
