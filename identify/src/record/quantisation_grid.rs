//! The lattice that readings lie on: the step of a converter, or of the digits that were printed.
//!
//! Readings of a converter are multiples of its step, and so are their differences; but what is printed is rounded once more,
//! to a unit `p` of the last digit. Each difference `d`, taken for `k` steps, then bounds the step:
//!
//! ```text
//! d - p <= k step <= d + p
//! ```

/// Equal steps, in V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// The likeliest.
    pub step: f64,
    /// The step may be as small as this,
    pub low: f64,
    /// and as large as this.
    pub high: f64,
}

/// Exact to so small a part of the step.
const EXACT: f64 = 1e-6;
/// A step finer than so many units of the last digit is the digits' own.
const UNITS: f64 = 4.0;
/// Most digits after the point that were printed on purpose.
const DIGITS: i32 = 9;
/// By chance less often than once in `exp` of this do so many differences fit.
const SURE: f64 = 12.0;

impl Lattice {
    /// Of different readings in rising order: the coarsest that they lie on.
    pub fn of(values: &[f64]) -> Option<Self> {
        printed(values)
            .or_else(|| common(values).map(|step| Self { step, low: step * (1.0 - EXACT), high: step * (1.0 + EXACT) }))
    }
}

/// The largest step of which all differences between values are multiples.
fn common(values: &[f64]) -> Option<f64> {
    let span = values.last()? - values.first()?;
    let tolerance = 1e-7 * span.max(1e-9);
    let mut step = span;
    for pair in values.windows(2) {
        // Euclid's algorithm.
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

/// A step that was rounded to the last digit.
fn printed(values: &[f64]) -> Option<Lattice> {
    let unit = unit(values)?;
    let first = values.first()?;
    let mut differences: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    differences.sort_by(f64::total_cmp);
    let least = *differences.first()?;
    let chance = (2.0 * unit / least).ln() * (differences.len() as f64 - 1.0);
    if least < UNITS * unit || chance > -SURE {
        return None;
    }
    let (mut low, mut high) = (least - unit, least + unit);
    // Neighbours first, then what is farther apart and says more.
    for difference in differences.into_iter().chain(values[1..].iter().map(|value| value - first)) {
        let fewest = ((difference - unit) / high).ceil();
        let most = ((difference + unit) / low).floor();
        if fewest > most {
            return None;
        }
        if fewest == most {
            (low, high) = (low.max((difference - unit) / most), high.min((difference + unit) / most));
        }
    }
    (low <= high).then(|| Lattice { step: (low + high) / 2.0, low, high })
}

/// Unit of the last digit that was printed, if few were.
fn unit(values: &[f64]) -> Option<f64> {
    let is_whole = |value: f64| (value - value.round()).abs() < EXACT * value.abs().max(1.0).sqrt();
    (0..DIGITS)
        .find(|&digits| values.iter().all(|value| is_whole(value * 10f64.powi(digits))))
        .map(|digits| 10f64.powi(-digits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_is_found_through_its_gaps() {
        let values: Vec<f64> = [0, 2, 5, 6, 11, 12, 20].iter().map(|&k| 3.7 + 2.5 * f64::from(k)).collect();
        assert!((Lattice::of(&values).unwrap().step - 2.5).abs() < 1e-9);
        let values: Vec<f64> = (1..200).map(|k| f64::from(k).sqrt()).collect();
        assert_eq!(Lattice::of(&values), None);
    }

    #[test]
    fn a_step_is_found_behind_the_digits_that_were_printed() {
        let printed = |step: f64, digits: i32| {
            let unit = 10f64.powi(digits);
            let value = |k: i32| (f64::from(k) * step * unit).round() / unit;
            (0..40).filter(|k| k % 7 != 3).map(value).collect::<Vec<_>>()
        };
        for digits in 1..=6 {
            let Lattice { step, low, high } = Lattice::of(&printed(14.554_425_3, digits)).unwrap();
            assert!((step - 14.554_425_3).abs() < 0.1 * 0.1f64.powi(digits), "{digits}: {step}");
            assert!(low <= 14.554_425_3 && 14.554_425_3 <= high, "{digits}: {low} to {high}");
        }
        // Digits alone: a step of one of them.
        let dense: Vec<f64> = (0..300).map(|k| f64::from(k) / 10.0).collect();
        assert!((Lattice::of(&dense).unwrap().step - 0.1).abs() < 1e-9);
        // Levels that have no common step.
        let levels = [0.0, 12.3, 31.9, 44.4, 58.2, 77.7, 93.1, 120.9, 141.6, 160.2];
        assert!(Lattice::of(&levels).is_none_or(|lattice| lattice.step < 0.2));
    }
}
