//! Comparison of two predictions of the same rows, segment by segment, with errors that may be correlated within a segment:
//!
//! ```text
//! z = sum_k d_k / sqrt(sum_k d_k^2)        d_k: sum of squares of one less that of the other in segment k
//! ```

use crate::stats::scale::root_mean_square;
use crate::stats::sums::dot;
use crate::stats::thresholds::probability::Z_WORSE;

/// Number of segments that are compared.
pub(crate) const SEGMENTS: usize = 40;

/// True if the errors `ours` are larger than `theirs` by more than a `factor` in root mean square, and beyond chance.
pub(crate) fn is_worse(ours: &[f64], theirs: &[f64], factor: f64) -> bool {
    root_mean_square(ours) > factor * root_mean_square(theirs) && excess(ours, theirs) > Z_WORSE
}

/// Standard normal quantile `z` of the excess of the errors `ours` over `theirs`; 0 for equal errors.
pub(crate) fn excess(ours: &[f64], theirs: &[f64]) -> f64 {
    let length = ours.len().div_ceil(SEGMENTS).max(1);
    let more = |(ours, theirs): (&[f64], &[f64])| dot(ours, ours) - dot(theirs, theirs);
    let more: Vec<f64> = ours.chunks(length).zip(theirs.chunks(length)).map(more).collect();
    more.iter().sum::<f64>() / dot(&more, &more).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;
    use crate::stats::thresholds::empirical::WORSE_THAN_LINEAR;

    const ROWS: usize = 2000;

    /// One segment with a large error tells nothing about the others.
    #[test]
    fn one_bad_segment_is_not_beyond_chance() {
        let theirs = normals(ROWS);
        let mut ours = theirs.clone();
        ours[200..250].iter_mut().for_each(|error| *error += 10.0);
        assert!(!is_worse(&ours, &theirs, WORSE_THAN_LINEAR.get()));
    }
}
