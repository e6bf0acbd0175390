//! Curves for a plot, thinned to what a screen shows.

use serde::Serialize;

/// Largest number of parts of a thinned curve; each keeps its first, lowest, highest and last point.
const MOST_PARTS: usize = 600;

/// Points of a curve by increasing position.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Curve {
    /// Positions: times, in s unless a unit is named.
    pub x: Vec<f64>,
    /// Values at the positions.
    pub y: Vec<f64>,
}

impl Curve {
    /// Makes a curve of `length` points. A long one keeps the extremes of each of its parts.
    pub fn new(length: usize, x: impl Fn(usize) -> f64, y: impl Fn(usize) -> f64) -> Self {
        let part = length.div_ceil(MOST_PARTS).max(1);
        let mut curve = Self::default();
        let mut add = |index: usize| {
            curve.x.push(x(index));
            curve.y.push(y(index));
        };
        for first in (0..length).step_by(part) {
            let last = (first + part).min(length) - 1;
            let by_value = |a: &usize, b: &usize| y(*a).total_cmp(&y(*b));
            let lowest = (first..=last).min_by(by_value).unwrap_or(first);
            let highest = (first..=last).max_by(by_value).unwrap_or(first);
            let mut kept = [first, lowest, highest, last];
            kept.sort_unstable();
            for (place, &index) in kept.iter().enumerate() {
                if place == 0 || kept[place - 1] != index {
                    add(index);
                }
            }
        }
        curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_curve_keeps_ends_and_extremes_and_a_short_one_every_point() {
        let spike = |index: usize| if index == 54_321 { 9.0 } else { (index as f64 / 7000.0).sin() };
        let curve = Curve::new(70_001, |index| index as f64, spike);
        assert!(curve.x.len() <= 4 * MOST_PARTS && curve.x.is_sorted_by(|a, b| a < b));
        assert_eq!((curve.x[0], curve.x.last()), (0.0, Some(&70_000.0)));
        assert!(curve.y.contains(&9.0));
        assert_eq!(Curve::new(3, |x| x as f64, |x| -(x as f64)).y, [0.0, -1.0, -2.0]);
        assert_eq!(Curve::new(0, |_| 0.0, |_| 0.0), Curve::default());
    }
}
