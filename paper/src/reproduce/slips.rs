//! Misprints: explanations by the printed digits alone.

use crate::misprint::{Pair, single_digit, swapped_digits};
use crate::reproduce::comparison::Comparison;
use crate::reproduce::digits::short;
use crate::reproduce::printed::{Relation, Rule};

/// Explanation of a number from a simulation whose numbers are truncated to two decimals.
pub(super) fn simulated(number: &Comparison, all: &[Comparison]) -> Option<String> {
    if number.rule != Rule::Truncated || number.printed.decimals != 2 || number.printed.exponent != 0 {
        return None;
    }
    let pair = |one: &Comparison| Pair { printed: one.printed.value, computed: one.outcome.value };
    let group: Vec<Pair> = all.iter().filter(|other| other.entry.group == number.entry.group).map(pair).collect();
    Some(pair(number).explain(&group))
}

/// Explanation by swapped or wrong digits, a shifted decimal point, or the reciprocal.
pub(super) fn slip_of_the_pen(number: &Comparison, used_as_printed: bool) -> Option<String> {
    let Comparison { printed, outcome, rule, .. } = number;
    let (found, expected) = (printed.digits(), printed.format_like(outcome.value, *rule));
    let all_digits = printed.significant_digits();
    if number.entry.relation == Relation::About {
        let near = |power: i32| printed.agrees(outcome.value * 10f64.powi(power), Relation::About, *rule);
        let power = [-2, -1, 1, 2].into_iter().find(|&power| near(power))?;
        return Some(format!("10^{power} of the computed {} would be about right", short(outcome.value)));
    }
    // The fewer digits agree, the weaker the evidence of a match.
    if all_digits >= 3
        && !used_as_printed
        && let Some((left, right)) = swapped_digits(&expected, &found)
    {
        return Some(format!("the computed {expected} with its neighbouring digits {left} and {right} swapped"));
    }
    for power in [-6, -3, -2, -1, 1, 2, 3, 6] {
        if printed.agrees(outcome.value * 10f64.powi(power), Relation::Equal, *rule) {
            return Some(format!(
                "the {all_digits} digits are right and the point is not: printed is 10^{power} of the computed {}",
                short(outcome.value)
            ));
        }
    }
    if outcome.value != 0.0 && printed.agrees(outcome.value.recip(), Relation::Equal, *rule) {
        return Some(format!("printed is the reciprocal of the computed {}", short(outcome.value)));
    }
    // A difference in the last digit is a matter of precision.
    let but_last = |text: &str| text.chars().take(text.len() - 1).collect::<String>();
    if all_digits >= 2
        && !used_as_printed
        && but_last(&expected) != but_last(&found)
        && let Some((wrong, right)) = single_digit(&expected, &found)
    {
        return Some(format!(
            "the computed {expected} with one digit of {all_digits} wrong, {wrong} in place of {right}"
        ));
    }
    None
}

/// Explanation of a reading by one misread digit, with the probability that one fits by chance.
pub(super) fn digit_of_a_reading(number: &Comparison) -> Option<String> {
    let (low, high) = number.outcome.expected?;
    // Half of the tolerated deviation.
    let half = 0.25 * (high - low);
    let fits = |digits: &(String, f64), expected: f64| (digits.1 - expected).abs() <= half;
    let misread = misread(number)?;
    let fitting: Vec<&str> =
        misread.iter().filter(|one| fits(one, 0.5 * (low + high))).map(|(text, _)| text.as_str()).collect();
    if fitting.is_empty() {
        return Some("no single digit changed puts it in line".to_owned());
    }
    // Frequency with which some digit would fit if the expected value lay anywhere up to twice as far away.
    let (printed, off) = (number.printed.value, number.printed.value - number.outcome.value);
    let elsewhere = (-1000..=1000).map(|part| printed + 2e-3 * f64::from(part) * off);
    let found = elsewhere.filter(|&expected| misread.iter().any(|one| fits(one, expected))).count();
    Some(format!(
        "one digit misread would explain it: {} (by chance one fits in {:.0} %)",
        fitting.join(" or "),
        1e2 * found as f64 / 2001.0
    ))
}

/// All numbers that differ from the printed one in a single digit: digits and value.
fn misread(number: &Comparison) -> Option<Vec<(String, f64)>> {
    let digits: Vec<char> = number.printed.digits().chars().collect();
    let mut others = Vec::new();
    for (place, old) in digits.iter().enumerate().filter(|(_, old)| old.is_ascii_digit()) {
        for new in ('0'..='9').filter(|new| new != old) {
            let mut other = digits.clone();
            other[place] = new;
            let text: String = other.into_iter().collect();
            let value = text.parse::<f64>().ok()? * 10f64.powi(number.printed.exponent);
            others.push((text, value));
        }
    }
    Some(others)
}

/// Explanation by a factor of 2 to 12 or its reciprocal, for numbers of at least three digits.
pub(super) fn simple_factor(number: &Comparison) -> Option<String> {
    let Comparison { printed, outcome, rule, .. } = number;
    if printed.significant_digits() < 3 {
        return None;
    }
    for factor in 2..=12 {
        let factor = f64::from(factor);
        for (factor, name) in [(factor, format!("{factor} times")), (1.0 / factor, format!("1/{factor} of"))] {
            if printed.agrees(outcome.value * factor, Relation::Equal, *rule) {
                return Some(format!("printed is {name} the computed {}, to all digits", short(outcome.value)));
            }
        }
    }
    None
}
