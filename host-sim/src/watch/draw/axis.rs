//! The range of an axis: as narrow as the values permit, with round ends, so that it moves seldom.

/// Least length of an axis, in V: a few steps of the DAC fill it.
const LEAST_V: f64 = 5.0;

/// Lowest, middle and highest value of an axis that shows `low` to `high`, all three multiples of a round step.
pub(super) fn range(low: f64, high: f64) -> [f64; 3] {
    let least = (LEAST_V - (high - low)).max(0.0) / 2.0;
    let (low, high) = (low - least, high + least);
    for step in (0..).flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(power))) {
        let first = (low / step).floor() * step;
        // Two steps below and above the middle.
        if high <= first + 4.0 * step {
            return [first, first + 2.0 * step, first + 4.0 * step];
        }
    }
    unreachable!("some step is as large as any finite range")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_is_round_and_at_most_four_times_as_long_as_its_values() {
        assert_eq!(range(0.0, 0.0), [-4.0, 0.0, 4.0]);
        assert_eq!(range(0.0, 700.0), [0.0, 400.0, 800.0]);
        assert_eq!(range(299.0, 301.0), [296.0, 300.0, 304.0]);
        for (low, high) in [(-2.0, 2.0), (13.7, 444.1), (0.0, 5.0), (-2048.0, 2048.0), (699.9, 700.0)] {
            let [first, middle, last] = range(low, high);
            assert!(first <= low && high <= last && middle - first == last - middle, "{low} {high}");
            assert!(last - first <= 4.0 * (high - low).max(LEAST_V), "{low} {high}: {first} {last}");
        }
    }
}
