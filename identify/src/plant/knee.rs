//! A bound that is approached gradually.

/// Returns `min(x, bound)` with a knee: `x - knee ln(1 + exp((x - bound) / knee))`; all in V. Without a knee the bound is sharp.
pub fn at_most(x: f64, bound: f64, knee: f64) -> f64 {
    if knee <= 0.0 {
        return x.min(bound);
    }
    // Without overflow far beyond the bound.
    x.min(bound) - knee * (-(x - bound).abs() / knee).exp().ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_knee_is_the_logarithm_of_a_sum_and_far_from_the_bound_nothing() {
        let expected = |x: f64| x - 20.0 * (1.0 + ((x - 300.0) / 20.0).exp()).ln();
        for x in [-500.0, 0.0, 250.0, 300.0, 310.0, 900.0] {
            assert!((at_most(x, 300.0, 20.0) - expected(x)).abs() < 1e-9, "{x}");
        }
        assert_eq!(at_most(1e9, 300.0, 20.0), 300.0);
        assert_eq!([at_most(200.0, 300.0, 0.0), at_most(400.0, 300.0, 0.0)], [200.0, 300.0]);
    }
}
