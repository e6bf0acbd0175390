//! Numbers and parameters as texts and pages show them.

use identify::answer::{LinearError, Parameter};
use identify::dimension::{Dimension, significant, with_interval};
use identify::record::scales::Scales;

/// Formats a parameter with its interval and unit, and says so if it is extrapolated.
pub(super) fn interval(parameter: &Parameter, scales: &Scales) -> String {
    let &Parameter { value, low, high, dimension, .. } = parameter;
    let size = dimension.size_of_shown_unit(&scales.units);
    let (value, interval) = with_interval([value / size, low / size, high / size]);
    let words = [value, interval, scales.unit(dimension)];
    let words: Vec<String> = words.into_iter().filter(|word| !word.is_empty()).collect();
    words.join(" ") + extrapolated(parameter)
}

/// The words after a parameter that is the value of a curve where the record has not been.
pub(super) fn extrapolated(parameter: &Parameter) -> &'static str {
    if parameter.extrapolated_from_v.is_some() { " (extrapolated)" } else { "" }
}

/// Name of the best linear model in tables of errors.
pub(super) fn linear_name(linear: &LinearError) -> String {
    format!("linear, order {}", linear.order)
}

/// Formats a number with four significant digits.
pub(in crate::output) fn number(value: f64) -> String {
    significant(value, 4)
}

/// A probability in words, with two decimals; one that would be rounded to zero is bounded.
pub(super) fn probability(value: f64) -> String {
    if value < 0.005 { "a probability below 0.01".into() } else { format!("a probability of {value:.2}") }
}

/// Name of a parameter without the suffix for its unit where the user's unit is another.
pub(super) fn shown_name<'n>(name: &'n str, dimension: Dimension, scales: &Scales) -> &'n str {
    if dimension.size_of_shown_unit(&scales.units) == 1.0 {
        return name;
    }
    ["_v_per_s", "_s", "_v", "_hz"].into_iter().find_map(|suffix| name.strip_suffix(suffix)).unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_probability_is_rounded_to_zero() {
        for (value, said) in
            [(0.314, "a probability of 0.31"), (0.005, "a probability of 0.01"), (0.0, "a probability below 0.01")]
        {
            assert_eq!(probability(value), said);
        }
    }

    #[test]
    fn an_interval_whose_ends_are_shown_alike_is_not_shown() {
        for numbers in [[500.0, 500.0, 500.0], [500.0, 500.0 - 1e-9, 500.0 + 1e-9]] {
            let parameter = Parameter {
                value: numbers[0],
                low: numbers[1],
                high: numbers[2],
                unit: "V".into(),
                dimension: Dimension::ReadingDifference,
                at_bound: false,
                extrapolated_from_v: None,
            };
            assert_eq!(interval(&parameter, &Scales::default()), "500.0 V");
        }
    }
}
