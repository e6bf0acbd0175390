//! Intervals over all forms of a set of causes that the record does not tell apart.
//!
//! A form is an assumption (a curve that is linear or geometric between its ends), and a value beyond what the record shows depends
//! on it. Each form counts with its posterior weight, `exp(score - best score)`; the 95 % interval of a parameter is that of the mixture
//! of the forms' distributions (Hoeting et al., "Bayesian model averaging", *Statistical Science* 14, 1999). The value stays that of the
//! best form.

use crate::answer::Parameter;
use crate::fit::engine::Engine;
use crate::fit::interval::parameters;
use crate::search::{Explored, Scored};
use crate::stats::thresholds::probability::{NATS_OF_A_FORM, Z};

/// Bisections of a quantile: its error is a 2^40th of the distance between the forms' own quantiles.
const BISECTIONS: usize = 40;

/// One form's weight and its distribution of a parameter.
struct Component {
    weight: f64,
    value: f64,
    low: f64,
    high: f64,
}

impl Component {
    /// Probability below `x`: half a normal distribution on each side of the value, as wide as the interval on that side.
    fn below(&self, x: f64) -> f64 {
        let width = if x < self.value { self.value - self.low } else { self.high - self.value };
        let distance = x - self.value;
        if width > 0.0 {
            0.5 * libm::erfc(-distance * Z / (width * std::f64::consts::SQRT_2))
        } else {
            f64::from(u8::from(distance >= 0.0))
        }
    }
}

/// Returns the parameters of an effect of the best structure with 95 % intervals over the forms in which the record may have its causes;
/// values are normalised.
pub(crate) fn parameters_over_forms(
    engine: &mut Engine,
    best: &Scored,
    explored: &Explored,
    effect: usize,
) -> Vec<(String, Parameter)> {
    let mut found = parameters(engine, &best.fit, effect);
    let others = explored.other_forms(best, NATS_OF_A_FORM);
    let others: Vec<_> =
        others.into_iter().map(|other| (other.score - best.score, parameters(engine, &other.fit, effect))).collect();
    for (name, parameter) in &mut found {
        let component =
            |score: f64, of: &Parameter| Component { weight: score.exp(), value: of.value, low: of.low, high: of.high };
        let same = |(score, parameters): &(f64, Vec<(String, Parameter)>)| {
            parameters.iter().find(|(other, _)| other == name).map(|(_, of)| component(*score, of))
        };
        let mut components: Vec<Component> = others.iter().filter_map(same).collect();
        if components.is_empty() {
            continue;
        }
        components.push(component(0.0, parameter));
        let tail = 0.5 * libm::erfc(Z / std::f64::consts::SQRT_2);
        parameter.low = quantile(&components, tail, |of| of.low).min(parameter.value);
        parameter.high = quantile(&components, 1.0 - tail, |of| of.high).max(parameter.value);
    }
    found
}

/// Value below which the mixture has the probability `below`; it lies between the smallest and the largest of the components' own.
fn quantile(components: &[Component], below: f64, own: impl Fn(&Component) -> f64) -> f64 {
    let whole: f64 = components.iter().map(|of| of.weight).sum();
    let mut low = components.iter().map(&own).fold(f64::INFINITY, f64::min);
    let mut high = components.iter().map(&own).fold(f64::NEG_INFINITY, f64::max);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        let at = components.iter().map(|of| of.weight * of.below(middle)).sum::<f64>() / whole;
        (low, high) = if at < below { (middle, high) } else { (low, middle) };
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(weight: f64, value: f64, deviation: f64) -> Component {
        Component { weight, value, low: value - Z * deviation, high: value + Z * deviation }
    }

    #[test]
    fn equal_components_keep_their_interval() {
        let two = [normal(1.0, 3.0, 0.5), normal(0.3, 3.0, 0.5)];
        assert!((quantile(&two, 0.025, |of| of.low) - (3.0 - Z * 0.5)).abs() < 1e-6);
    }

    #[test]
    fn a_distant_component_with_a_tenth_of_the_weight_is_included() {
        let two = [normal(0.9, 0.0, 1.0), normal(0.1, 10.0, 1.0)];
        let high = quantile(&two, 0.975, |of| of.high);
        // A quarter of the distant component is above.
        assert!((high - (10.0 + 0.674_490)).abs() < 1e-3, "{high}");
        assert!((quantile(&two, 0.025, |of| of.low) + 1.914_5).abs() < 1e-3);
    }

    #[test]
    fn a_distant_component_of_a_hundredth_is_not() {
        let two = [normal(0.99, 0.0, 1.0), normal(0.01, 10.0, 1.0)];
        assert!(quantile(&two, 0.975, |of| of.high) < 3.0);
    }
}
