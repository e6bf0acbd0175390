//! The grid on which readings lie: steps of the converter, or of the last printed digit.
//!
//! Readings of a converter and their differences are multiples of its step, but printing rounds them once more, to a
//! unit of the last digit: that of a number of decimals, or of a number of significant digits, which is smaller for smaller
//! readings. A difference `d` of `k` steps between readings with a mean unit `p` then bounds the step:
//!
//! ```text
//! d - p <= k step <= d + p
//! ```

use crate::stats::thresholds::empirical::FEWEST_UNITS;
use crate::stats::thresholds::probability::CHANCE_NATS;

/// A step to which readings were rounded, with its bounds, in V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuantisationGrid {
    /// Most likely step, in V.
    pub step: f64,
    /// Smallest step that agrees with the readings, in V.
    pub low: f64,
    /// Largest step that agrees with the readings, in V.
    pub high: f64,
}

/// Relative uncertainty of a step that is not limited by printed digits.
const RELATIVE_ERROR: f64 = 1e-6;
/// Largest number of significant digits that is taken for deliberate rounding; one more than that of decimals.
const MOST_DIGITS: i32 = 9;

impl QuantisationGrid {
    /// Returns the coarsest grid that contains all values, which must be distinct and in ascending order; `None` if
    /// there is none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let printed =
            || [decimals(values), significant(values)].into_iter().flatten().find_map(|p| printed(values, &p));
        printed().or_else(|| {
            common(values).map(|step| Self {
                step,
                low: step * (1.0 - RELATIVE_ERROR),
                high: step * (1.0 + RELATIVE_ERROR),
            })
        })
    }
}

/// Returns the largest step of which all differences between values are multiples, within rounding.
fn common(values: &[f64]) -> Option<f64> {
    let span = values.last()? - values.first()?;
    let tolerance = 1e-7 * span.max(1e-9);
    let mut step = span;
    for pair in values.windows(2) {
        // Euclid's algorithm, with a tolerance for rounding.
        let (mut a, mut b) = (step, pair[1] - pair[0]);
        while b > tolerance {
            (a, b) = (b, a - b * (a / b + 1e-4).floor());
            b = b.max(0.0);
        }
        step = a;
        if step < 20.0 * tolerance {
            return None;
        }
    }
    (step < span).then_some(step)
}

/// Returns the bounds of a step whose multiples were rounded to the last printed digit, of which each value has its unit.
fn printed(values: &[f64], units: &[f64]) -> Option<QuantisationGrid> {
    let between = |from: usize, to: usize| (values[to] - values[from], 0.5 * (units[from] + units[to]));
    let mut differences: Vec<(f64, f64)> = (1..values.len()).map(|to| between(to - 1, to)).collect();
    differences.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (least, unit) = *differences.first()?;
    // One of the differences is the step by definition.
    let chances = differences.iter().map(|(_, unit)| (2.0 * unit / least).ln()).sum::<f64>();
    let chance = chances * (1.0 - 1.0 / differences.len() as f64);
    let coarsest = differences.iter().map(|(_, unit)| *unit).fold(0.0, f64::max);
    if least < FEWEST_UNITS.get() * coarsest || chance > -CHANCE_NATS {
        return None;
    }
    let (mut low, mut high) = (least - unit, least + unit);
    // Differences of neighbours first; larger differences then narrow the bounds.
    for (difference, unit) in differences.into_iter().chain((1..values.len()).map(|to| between(0, to))) {
        let fewest = ((difference - unit) / high).ceil();
        let most = ((difference + unit) / low).floor();
        if fewest > most {
            return None;
        }
        if fewest == most {
            (low, high) = (low.max((difference - unit) / most), high.min((difference + unit) / most));
        }
    }
    (low <= high).then(|| QuantisationGrid { step: (low + high) / 2.0, low, high })
}

/// Returns true if a number of units is whole.
fn is_whole(units: f64) -> bool {
    (units - units.round()).abs() < RELATIVE_ERROR * units.abs().max(1.0).sqrt()
}

/// Returns the unit of the last printed digit, for each value, if there are fewer than [`MOST_DIGITS`] decimals.
fn decimals(values: &[f64]) -> Option<Vec<f64>> {
    let unit = |digits: i32| 10f64.powi(digits);
    let digits = (0..MOST_DIGITS).find(|&digits| values.iter().all(|value| is_whole(value * unit(digits))))?;
    Some(vec![1.0 / unit(digits); values.len()])
}

/// Returns the same if each value has at most [`MOST_DIGITS`] significant digits.
fn significant(values: &[f64]) -> Option<Vec<f64>> {
    let unit = |value: f64, digits: i32| match value.abs().log10().floor() {
        exponent if exponent.is_finite() => 10f64.powi(exponent as i32 + 1 - digits),
        _ => 0.0,
    };
    let is_whole = |value: f64, digits: i32| value == 0.0 || is_whole(value / unit(value, digits));
    let digits = (1..=MOST_DIGITS).find(|&digits| values.iter().all(|&value| is_whole(value, digits)))?;
    Some(values.iter().map(|&value| unit(value, digits)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_is_found_with_values_missing() {
        let values: Vec<f64> = [0, 2, 5, 6, 11, 12, 20].iter().map(|&k| 3.7 + 2.5 * f64::from(k)).collect();
        assert!((QuantisationGrid::of(&values).unwrap().step - 2.5).abs() < 1e-9);
        let values: Vec<f64> = (1..200).map(|k| f64::from(k).sqrt()).collect();
        assert_eq!(QuantisationGrid::of(&values), None);
    }

    #[test]
    fn step_is_found_in_values_rounded_to_printed_digits() {
        let printed = |step: f64, digits: i32| {
            let unit = 10f64.powi(digits);
            let value = |k: i32| (f64::from(k) * step * unit).round() / unit;
            (0..40).filter(|k| k % 7 != 3).map(value).collect::<Vec<_>>()
        };
        for digits in 1..=6 {
            let QuantisationGrid { step, low, high } = QuantisationGrid::of(&printed(14.554_425_3, digits)).unwrap();
            assert!((step - 14.554_425_3).abs() < 0.1 * 0.1f64.powi(digits), "{digits}: {step}");
            assert!(low <= 14.554_425_3 && 14.554_425_3 <= high, "{digits}: {low} to {high}");
        }
        // Printed with a number of significant digits, smaller values have more decimals.
        let value = |k: i32| format!("{:.5e}", f64::from(k) * 0.145_544_253).parse().unwrap();
        let digits: Vec<f64> = (-9..90).filter(|k| k % 7 != 3).map(value).collect();
        let QuantisationGrid { step, low, high } = QuantisationGrid::of(&digits).unwrap();
        assert!((step - 0.145_544_253).abs() < 1e-5 && low <= 0.145_544_253 && 0.145_544_253 <= high, "{step}");
        // Without a coarser step, the step is one unit of the last digit.
        let dense: Vec<f64> = (0..300).map(|k| f64::from(k) / 10.0).collect();
        assert!((QuantisationGrid::of(&dense).unwrap().step - 0.1).abs() < 1e-9);
        // These levels have no common step.
        let levels = [0.0, 12.3, 31.9, 44.4, 58.2, 77.7, 93.1, 120.9, 141.6, 160.2];
        assert!(QuantisationGrid::of(&levels).is_none_or(|grid| grid.step < 0.2));
    }
}
