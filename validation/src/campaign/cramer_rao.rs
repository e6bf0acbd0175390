//! Cramer-Rao bound: the smallest error of any unbiased estimate of a parameter if the structure, the noise (white,
//! Gaussian) and all other effects of the record are known.
//!
//! The covariance is sigma^2 (J^T J)^-1, where J holds the derivatives of the expected readings by the effect's values.
//! Quantisation, outliers, saturation, the ends of a segment and the curve of a static nonlinearity have no such
//! derivative and no bound here.

use crate::ground_truth::{Cause, LabelledRecord};
use crate::statistics::dot;

/// Median distance from the mean of a normal distribution, in standard deviations.
const MEDIAN: f64 = 0.6745;
/// Relative change of a value for its numerical derivative.
const CHANGE: f64 = 1e-3;

/// Smallest possible median of a parameter's relative error in this record; `None` where there is no bound.
pub fn median_error(hidden: &LabelledRecord, cause: Cause, parameter: &str) -> Option<f64> {
    use Cause::{Outliers, Quantisation, ReadingOffset, SensorSaturation};
    if matches!(cause, Quantisation | Outliers | SensorSaturation | ReadingOffset) {
        return None;
    }
    let wanted = cause.facts().parameters.iter().position(|&name| name == parameter)?;
    let index = hidden.effects.iter().position(|effect| effect.cause == cause)?;
    // The participation of a resonance is known, the phase of a hum is not.
    let unknown = if cause == Cause::Resonance { 2 } else { hidden.effects[index].full_size.len() };
    let values = hidden.effects[index].values();
    let columns: Vec<Vec<f64>> = (0..unknown).map(|value| derivative(hidden, index, value)).collect();
    // The part of the wanted column that no other explains: Gram-Schmidt with the wanted column last.
    let mut order: Vec<usize> = (0..unknown).filter(|&column| column != wanted).collect();
    order.push(wanted);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for column in order {
        let mut rest = columns[column].clone();
        for known in &basis {
            let factor = dot(&rest, known) / dot(known, known);
            rest.iter_mut().zip(known).for_each(|(rest, known)| *rest -= factor * known);
        }
        basis.push(rest);
    }
    let own = basis.last()?;
    let deviation = hidden.noise.sigma_v / dot(own, own).sqrt();
    Some(MEDIAN * deviation / values[wanted].abs()).filter(|error| error.is_finite())
}

/// Central difference quotient of the expected readings by one of an effect's values.
fn derivative(hidden: &LabelledRecord, index: usize, value: usize) -> Vec<f64> {
    let change = CHANGE * hidden.effects[index].full_size[value].abs();
    let expected = |by: f64| {
        let mut effects = hidden.effects.clone();
        effects[index].full_size = effects[index].values();
        effects[index].full_size[value] += by;
        effects[index].size = 1.0;
        LabelledRecord::new(hidden.schedule.clone(), effects, hidden.noise, hidden.seed).readings.expected
    };
    expected(change).iter().zip(expected(-change)).map(|(a, b)| (a - b) / (2.0 * change)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground_truth::record::Recipe;

    #[test]
    fn bounds_of_a_gain_and_of_a_hum_follow_the_closed_formulas() {
        let hidden = Recipe::of(&[Cause::GainError]).draw(2);
        let gain = hidden.effects[0].values()[0];
        let power: f64 = hidden.at(0.0).readings.expected.iter().map(|y| y * y).sum();
        let found = median_error(&hidden, Cause::GainError, "gain").unwrap();
        assert!((found / (MEDIAN * hidden.noise.sigma_v / power.sqrt() / gain) - 1.0).abs() < 1e-6);

        // The amplitude of a sine in white noise has the variance 2 sigma^2/n.
        let hidden = Recipe::of(&[Cause::Hum]).draw(2);
        let amplitude = hidden.effects[0].values()[0];
        let expected = MEDIAN * hidden.noise.sigma_v * (2.0f64 / 2401.0).sqrt() / amplitude;
        let found = median_error(&hidden, Cause::Hum, "amplitude").unwrap();
        assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
    }

    #[test]
    fn every_parameter_can_be_estimated_to_5_percent_at_full_size() {
        for cause in Cause::ALL {
            for parameter in cause.facts().parameters {
                let records = (0..9).map(|seed| Recipe::of(&[cause]).draw(300 + seed));
                let bounds = records.filter_map(|hidden| median_error(&hidden, cause, parameter)).collect::<Vec<_>>();
                let median = crate::statistics::median(&bounds);
                assert!(median.is_none_or(|bound| bound < 0.05), "{cause} {parameter}: {median:?} at best");
            }
        }
    }
}
