//! Rank correlation (Spearman, "The proof and measurement of association between two things", *Am. J. Psychol.* 15, 1904): whether one
//! value rises with another, whatever the curve.

/// Standard normal quantile of the rank correlation of pairs of values, `rho sqrt(n - 1)`, for independent values; equal values share
/// their mean rank. 0 if all values of one kind are equal.
pub(crate) fn rank_correlation(one: &[f64], other: &[f64]) -> f64 {
    let [one, other] = [one, other].map(centred_ranks);
    let product = |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(one, other)| one * other).sum::<f64>();
    let size = (product(&one, &one) * product(&other, &other)).sqrt();
    if size > 0.0 { product(&one, &other) / size * (one.len() as f64 - 1.0).sqrt() } else { 0.0 }
}

/// Ranks of values less their mean.
fn centred_ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&one, &other| values[one].total_cmp(&values[other]));
    let mut ranks = vec![0.0; values.len()];
    let mut below = 0;
    for equal in order.chunk_by(|&one, &other| values[one] == values[other]) {
        let rank = below as f64 + 0.5 * (equal.len() as f64 - 1.0);
        equal.iter().for_each(|&place| ranks[place] = rank - 0.5 * (values.len() as f64 - 1.0));
        below += equal.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correlation_is_that_of_the_ranks() {
        let values = [1.0, 20.0, 300.0, 4000.0, 5e4];
        assert_eq!(rank_correlation(&values, &[-2.0, 0.0, 0.1, 0.2, 7.0]), 2.0);
        assert_eq!(rank_correlation(&values, &[9.0, 8.0, 7.0, 6.0, 5.0]), -2.0);
        // 1 - 6 (1 + 1 + 0 + 1 + 1) / (5 * 24) = 0.8.
        let swapped = rank_correlation(&values, &[2.0, 1.0, 3.0, 5.0, 4.0]);
        assert!((swapped - 1.6).abs() < 1e-12, "{swapped}");
        // Equal values share the mean of their ranks: ranks -2, -0.5, -0.5, 1, 2 with a product of 9.5 of 10 and 9.5.
        let equal = rank_correlation(&values, &[1.0, 2.0, 2.0, 3.0, 4.0]);
        assert!((equal - 2.0 * 9.5 / (10.0f64 * 9.5).sqrt()).abs() < 1e-12, "{equal}");
        assert_eq!(rank_correlation(&values, &[3.0; 5]), 0.0);
        assert_eq!(rank_correlation(&[], &[]), 0.0);
    }
}
