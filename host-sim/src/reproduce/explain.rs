//! Why a printed number is not what comes out: general explanations, tried in order of how much they claim.
//!
//! A slip of the pen must give the printed digits exactly. Another input must be printed in the report for the same
//! quantity. Where nothing fits, it is said what one input would have to be, and nothing is claimed.

use std::collections::BTreeMap;

use anyhow::Result;
use toml::Value;

use super::Judged;
use super::compute::{Inputs, compute, number};
use super::printed::{Relation, Rule};
use crate::misprint::{Pair, single_digit, swapped_digits};

/// The likeliest explanation of a disagreement, with its evidence.
pub(crate) fn explain(number: &Judged, all: &[Judged]) -> Result<String> {
    let mut said: Vec<String> = number.outcome.evidence.clone().into_iter().collect();
    said.extend(first_explanation(number, all)?);
    said.extend(with_its_likes(number, all));
    Ok(said.join(". "))
}

/// The first explanation that fits.
fn first_explanation(number: &Judged, all: &[Judged]) -> Result<Option<String>> {
    if number.entry.relation != Relation::Equal && number.entry.relation != Relation::About {
        return Ok(Some(other_reading(number, all)?.unwrap_or_else(|| off(number))));
    }
    if number.outcome.expected.is_some() {
        return Ok(digit_of_a_reading(number));
    }
    if let Some(slip) = simulated(number, all).or_else(|| slip_of_the_pen(number)) {
        return Ok(Some(slip));
    }
    if let Some(other) = other_reading(number, all)? {
        return Ok(Some(other));
    }
    let simple = terms_left_out(number)?.or_else(|| simple_factor(number));
    Ok(match simple {
        Some(simple) => Some(simple),
        None => Some(
            [off(number), input_needed(number)?].into_iter().filter(|s| !s.is_empty()).collect::<Vec<_>>().join("; "),
        ),
    })
}

fn off(number: &Judged) -> String {
    let (printed, computed) = (number.printed.value, number.outcome.value);
    let ratio = printed / computed;
    if !(0.1..10.0).contains(&ratio) {
        return format!("printed is {ratio:.3e} times what is computed");
    }
    format!("printed is {:+.1} % off what is computed", 1e2 * (ratio - 1.0))
}

/// A number of a simulation that was cut off at two decimals: its own, finer, explanations.
fn simulated(number: &Judged, all: &[Judged]) -> Option<String> {
    if number.rule != Rule::Truncated || number.printed.decimals != 2 || number.printed.exponent != 0 {
        return None;
    }
    let pair = |one: &Judged| Pair { printed: one.printed.value, computed: one.outcome.value };
    let group: Vec<Pair> = all.iter().filter(|other| other.entry.group == number.entry.group).map(pair).collect();
    Some(pair(number).explain(&group))
}

/// Swapped or wrong digits, a shifted point, the reciprocal.
fn slip_of_the_pen(number: &Judged) -> Option<String> {
    let Judged { printed, outcome, rule, .. } = number;
    let (found, expected) = (printed.digits(), printed.alike(outcome.value, *rule));
    let all_digits = printed.significant_digits();
    // The fewer digits agree, the less such a match says.
    if all_digits >= 3
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
    if all_digits >= 2
        && let Some((wrong, right)) = single_digit(&expected, &found)
    {
        return Some(format!(
            "the computed {expected} with one digit of {all_digits} wrong, {wrong} in place of {right}"
        ));
    }
    None
}

/// A reading that one digit would put in line.
fn digit_of_a_reading(number: &Judged) -> Option<String> {
    let (low, high) = number.outcome.expected?;
    let digits: Vec<char> = number.printed.digits().chars().collect();
    let mut fitting: Vec<String> = Vec::new();
    for (place, old) in digits.iter().enumerate().filter(|(_, old)| old.is_ascii_digit()) {
        for new in ('0'..='9').filter(|new| new != old) {
            let mut other = digits.clone();
            other[place] = new;
            let text: String = other.into_iter().collect();
            let value = text.parse::<f64>().ok()? * 10f64.powi(number.printed.exponent);
            if (low..=high).contains(&value) {
                fitting.push(text);
            }
        }
    }
    match &fitting[..] {
        [] => Some("no change of a single digit puts it in line".to_owned()),
        fitting => Some(format!("with one digit misread it would be in line: {}", fitting.join(" or "))),
    }
}

/// Another input, printed in the report for the same quantity or meant by the same words.
fn other_reading(number: &Judged, all: &[Judged]) -> Result<Option<String>> {
    if number.entry.of_table {
        return Ok(None);
    }
    let mut nearest: Option<(f64, String)> = None;
    for (name, values) in alternatives(number, all) {
        for value in values {
            let mut inputs = number.entry.inputs.clone();
            inputs.insert(name.clone(), value.clone());
            // What cannot be computed is no explanation.
            let Ok(other) = compute(&number.entry.of, &Inputs(&inputs)) else { continue };
            let said = format!("{name} = {value} in place of {}", number.entry.inputs[&name]);
            if number.printed.agrees(other.value, number.entry.relation, number.rule) {
                return Ok(Some(format!("with {said} it would agree: {}", short(other.value))));
            }
            let miss = (other.value / number.printed.value).ln().abs();
            if miss.is_finite() && nearest.as_ref().is_none_or(|(least, _)| miss < *least) {
                nearest = Some((miss, format!("{said}: {}", short(other.value))));
            }
        }
    }
    let miss = (number.outcome.value / number.printed.value).ln().abs();
    // Ten times nearer, and near.
    Ok(nearest
        .filter(|(least, _)| *least < 0.1 && 10.0 * least < miss || miss.is_nan() && *least < 0.1)
        .map(|(least, said)| format!("{}; nearest is {said}, {:.1} % off", off(number), 1e2 * least.exp_m1())))
}

/// What else an input may be: what the text may mean, then what is printed elsewhere under the same name.
fn alternatives(number: &Judged, all: &[Judged]) -> Vec<(String, Vec<Value>)> {
    let mut found: BTreeMap<&String, Vec<Value>> = BTreeMap::new();
    for (name, own) in &number.entry.inputs {
        let values = found.entry(name).or_default();
        values.extend(number.entry.also.get(name).into_iter().flatten().cloned());
        // Only what is counted or measured: "part" or "step" of another question are no alternatives.
        let unit = name.contains('_') || super::compute::number(own).is_some_and(|value| value > 100.0);
        let others =
            all.iter().filter(|other| unit && !other.entry.of_table).filter_map(|other| other.entry.inputs.get(name));
        values.extend(others.filter(|value| super::compute::number(value).is_some()).cloned());
        values.retain(|value| super::compute::number(value) != super::compute::number(own));
        values.dedup();
    }
    found.into_iter().map(|(name, values)| (name.clone(), values)).collect()
}

/// A sum that agrees without some of its terms.
fn terms_left_out(number: &Judged) -> Result<Option<String>> {
    let Some(terms) = number.entry.inputs.get("terms").and_then(Value::as_array) else { return Ok(None) };
    if terms.len() > 12 {
        return Ok(None);
    }
    // Fewest left out first.
    let mut choices: Vec<usize> = (1..1usize << terms.len()).collect();
    choices.sort_by_key(|kept| std::cmp::Reverse(kept.count_ones()));
    for kept in choices {
        let some: Vec<Value> = terms
            .iter()
            .enumerate()
            .filter(|(index, _)| kept >> index & 1 == 1)
            .map(|(_, term)| term.clone())
            .collect();
        let left: Vec<String> = some.iter().map(|term| term.to_string()).collect();
        let mut inputs = number.entry.inputs.clone();
        inputs.insert("terms".to_owned(), Value::Array(some));
        let value = compute(&number.entry.of, &Inputs(&inputs))?.value;
        if number.printed.agrees(value, Relation::Equal, number.rule) {
            return Ok(Some(format!(
                "{}; it is the sum of {} of the {} terms only: {}",
                off(number),
                left.len(),
                terms.len(),
                left.join(" + ")
            )));
        }
    }
    Ok(None)
}

/// A small whole number times what is computed, to all of at least three digits.
fn simple_factor(number: &Judged) -> Option<String> {
    let Judged { printed, outcome, rule, .. } = number;
    if printed.significant_digits() < 3 {
        return None;
    }
    for factor in 2..=12 {
        let factor = f64::from(factor);
        for (factor, name) in [(factor, format!("{factor} times")), (1.0 / factor, format!("one part in {factor} of"))]
        {
            if printed.agrees(outcome.value * factor, Relation::Equal, *rule) {
                return Some(format!("printed is {name} the computed {}, to all digits", short(outcome.value)));
            }
        }
    }
    None
}

/// What one input would have to be for the printed number to come out.
fn input_needed(number: &Judged) -> Result<String> {
    let mut needed = Vec::new();
    for (name, own) in &number.entry.inputs {
        let Some(own) = self::number(own).filter(|own| *own > 0.0) else { continue };
        let miss = |factor: f64| {
            let mut inputs = number.entry.inputs.clone();
            inputs.insert(name.clone(), Value::Float(own * factor));
            compute(&number.entry.of, &Inputs(&inputs)).map(|outcome| outcome.value - number.printed.value)
        };
        if let Some(factor) = root(miss) {
            needed.push(format!("{name} = {} in place of {own}", short(own * factor)));
        }
    }
    if needed.is_empty() || number.entry.of == "same" {
        return Ok(String::new());
    }
    Ok(format!("it would take {}", needed.join(", or ")))
}

/// A factor between 0.01 and 100 at which `miss` is zero.
fn root(miss: impl Fn(f64) -> Result<f64>) -> Option<f64> {
    const PARTS: i32 = 40;
    let at = |part: i32| 10f64.powf(2.0 * f64::from(part) / f64::from(PARTS));
    let sign = |factor: f64| miss(factor).ok().map(f64::signum);
    // From 1 outwards.
    for part in 0..PARTS {
        for (near, far) in [(part, part + 1), (-part, -part - 1)] {
            let (Some(start), Some(end)) = (sign(at(near)), sign(at(far))) else { continue };
            if start == end {
                continue;
            }
            let (mut one, mut other) = (at(near), at(far));
            for _ in 0..60 {
                let middle = (one * other).sqrt();
                if sign(middle)? == start { one = middle } else { other = middle }
            }
            return Some((one * other).sqrt());
        }
    }
    None
}

/// Other numbers of the table with the same inputs but one, and how far they are off.
fn with_its_likes(number: &Judged, all: &[Judged]) -> Option<String> {
    if !number.entry.of_table || number.outcome.expected.is_none() {
        return None;
    }
    let ratio = |one: &Judged| one.printed.value / one.outcome.value;
    let same = |other: &&Judged| {
        other.entry.group == number.entry.group
            && other.entry.place != number.entry.place
            && other.entry.inputs.get("voltage_v") == number.entry.inputs.get("voltage_v")
            && other.entry.inputs.contains_key("force_un")
    };
    let likes: Vec<&Judged> = all.iter().filter(same).collect();
    if likes.is_empty() {
        return None;
    }
    let others: Vec<String> = likes.iter().map(|like| format!("{:+.1} %", 1e2 * (ratio(like) - 1.0))).collect();
    let alike = likes.iter().all(|like| (ratio(like) - ratio(number)).abs() < 0.05);
    Some(format!(
        "it is off by {:+.1} %, at the same voltage the other by {}: {}",
        1e2 * (ratio(number) - 1.0),
        others.join(", "),
        if alike { "a common cause, such as another sample or mounting" } else { "this one alone" }
    ))
}

fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        let decimals = (5 - value.abs().max(1e-3).log10().floor() as i32).clamp(0, 8) as usize;
        let text = format!("{value:.decimals$}");
        return if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    }
    format!("{value:.4e}")
}

#[cfg(test)]
mod tests {
    use super::super::compute::Outcome;
    use super::super::printed::Printed;
    use super::super::source::{BearsOn, Entry};
    use super::*;

    fn judged(printed: &str, of: &str, inputs: &str, also: &str) -> Judged {
        let inputs: BTreeMap<String, Value> = toml::from_str(inputs).unwrap();
        let entry = Entry {
            place: "here".to_owned(),
            printed: printed.to_owned(),
            unit: String::new(),
            relation: Relation::Equal,
            of: of.to_owned(),
            inputs,
            also: toml::from_str(also).unwrap(),
            bears_on: BearsOn::Result,
            group: "here".to_owned(),
            of_table: false,
        };
        let outcome: Outcome = compute(of, &Inputs(&entry.inputs)).unwrap();
        Judged { printed: Printed::new(printed).unwrap(), outcome, rule: Rule::Rounded, agrees: false, entry }
    }

    /// Each kind of slip, made on purpose, is told from the others.
    #[test]
    fn each_slip_is_told() {
        let product = "factors = [3.0, 4.1234]";
        for (printed, of, inputs, also, expected) in [
            ("12.73", "product", product, "", "digits 3 and 7 swapped"),
            ("12.57", "product", product, "", "one digit of 4 wrong, 5 in place of 3"),
            ("1.237", "product", product, "", "printed is 10^-1 of"),
            ("1.2370e3", "product", product, "", "printed is 10^2 of"),
            ("0.08084", "product", product, "", "the reciprocal"),
            ("37.11", "product", product, "", "3 times the computed"),
            ("4.1233", "sum", "terms = [3.0, 4.1233, 1.5]", "", "1 of the 3 terms only: 4.1233"),
            (
                "15.708",
                "quotient",
                "dividend = 31.416\ndivisor = 3.0",
                "divisor = [2.0]",
                "with divisor = 2.0 in place of 3.0 it would agree",
            ),
            ("8.111", "quotient", "dividend = 31.416\ndivisor = 3.0", "", "it would take dividend = 24.333"),
            ("77.7", "product", product, "", "printed is +528.1 % off"),
        ] {
            let number = judged(printed, of, inputs, also);
            let said = explain(&number, &[]).unwrap();
            assert!(said.contains(expected), "{printed}: {said}");
        }
    }

    #[test]
    fn a_reading_that_one_digit_puts_in_line() {
        let mut number = judged("331", "sum", "terms = [349]", "");
        number.outcome.expected = Some((343.0, 355.0));
        assert_eq!(digit_of_a_reading(&number).unwrap(), "with one digit misread it would be in line: 351");
        number.outcome.expected = Some((445.0, 455.0));
        assert!(digit_of_a_reading(&number).unwrap().starts_with("no change"));
    }

    #[test]
    fn roots() {
        let found = root(|factor| Ok(factor - 0.3)).unwrap();
        assert!((found - 0.3).abs() < 1e-9);
        assert!(root(|_| Ok(1.0)).is_none());
    }
}
