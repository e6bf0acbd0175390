//! The middle of some values, which far ones do not move.

/// A normal's median size, in standard deviations.
const NORMAL: f64 = 0.6745;
/// Neighbours to each side of a row.
const AROUND: usize = 2;

/// The upper middle of the values, which it reorders; `None` if there are none.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The standard deviation of a normal around zero with this median size; `None` if there are no values.
pub(crate) fn deviation(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    median(&mut sizes).map(|size| size / NORMAL)
}

/// Of each row and two neighbours to each side; at the ends, of the first and the last five. At least five values.
pub(crate) fn running(values: &[f64]) -> Vec<f64> {
    let of_row = |row: usize| {
        let first = row.saturating_sub(AROUND).min(values.len() - 2 * AROUND - 1);
        let mut around: [f64; 2 * AROUND + 1] = std::array::from_fn(|k| values[first + k]);
        *around.select_nth_unstable_by(AROUND, f64::total_cmp).1
    };
    (0..values.len()).map(of_row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_values_move_no_median() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [3.0, 1e9, 1.0]), Some(3.0));
        assert_eq!(deviation([-0.6745, 1e9, 0.1].into_iter()), Some(1.0));
        assert_eq!(running(&[1.0, 2.0, 1e9, 4.0, 5.0, 6.0]), [4.0, 4.0, 4.0, 5.0, 5.0, 5.0]);
    }
}
