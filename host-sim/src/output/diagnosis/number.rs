//! Numbers and parameters as texts and pages show them.

use identify::answer::{LinearError, Parameter};
use identify::dimension::{Dimension, significant};
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

/// Formats a value and its interval, `[low, high]`, with two significant digits of the interval's half-width, and with four
/// significant digits where it has no width or the numbers are of very different size. The interval is empty where its ends
/// are one number then: the value is fixed, or known to all digits that are shown.
pub(in crate::output) fn with_interval(numbers: [f64; 3]) -> (String, String) {
    let [value, low, high] = rounded(numbers);
    let interval = if low == high { String::new() } else { format!("[{low}, {high}]") };
    (value, interval)
}

fn rounded([value, low, high]: [f64; 3]) -> [String; 3] {
    let half = 0.5 * (high - low);
    let decimals = 1 - half.log10().floor().clamp(-99.0, 99.0) as i32;
    let large = value.abs().max(low.abs()).max(high.abs());
    if !(half > 0.0 && half.is_finite() && (-6..=9).contains(&decimals) && large < 1e7) {
        return [value, low, high].map(number);
    }
    let decimals = decimals.max(0) as usize;
    // What rounds to zero has no sign.
    let zero = 0.5 * 10f64.powi(-(decimals as i32));
    [value, low, high].map(|it| format!("{:.decimals$}", if it.abs() < zero { 0.0 } else { it }))
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
    fn digits_follow_the_width_of_the_interval() {
        for (numbers, value, interval) in [
            ([1.200_031, 1.199_874, 1.200_188], "1.20003", "[1.19987, 1.20019]"),
            ([-70.6, -90.0, -51.2], "-71", "[-90, -51]"),
            ([645.653, 645.4621, 645.844], "645.65", "[645.46, 645.84]"),
            ([0.001, -0.01, 0.012], "0.001", "[-0.010, 0.012]"),
            ([1e-12, 9e-13, 1.1e-12], "1.000e-12", "[9.000e-13, 1.100e-12]"),
        ] {
            assert_eq!(with_interval(numbers), (value.to_owned(), interval.to_owned()));
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
