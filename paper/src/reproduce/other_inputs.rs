//! Explanations by other inputs: another printed value, omitted terms, or the value that an input would need.

use std::collections::BTreeMap;

use anyhow::Result;
use toml::Value;

use crate::reproduce::comparison::Comparison;
use crate::reproduce::compute::compute;
use crate::reproduce::digits::short;
use crate::reproduce::inputs::{Inputs, number as as_number};

/// Explanation by another value of an input: one that the report prints under the same name or that the text may mean.
pub(super) fn other_value(number: &Comparison, all: &[Comparison]) -> Result<Option<String>> {
    if number.entry.of_table {
        return Ok(None);
    }
    let mut nearest: Option<(f64, String)> = None;
    for (name, values) in alternatives(number, all) {
        for value in values {
            let mut inputs = number.entry.inputs.clone();
            inputs.insert(name.clone(), value.clone());
            // A value for which the computation fails explains nothing.
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
    // Reported if the deviation is below about 10 % and at least ten times smaller than before.
    Ok(nearest
        .filter(|(least, _)| *least < 0.1 && (miss.is_nan() || 10.0 * least < miss))
        .map(|(least, said)| format!("{}; nearest is {said}, {:.1} % off", number.difference(), 1e2 * least.exp_m1())))
}

/// Other values of the inputs: first those the text may mean, then those printed elsewhere under the same name.
fn alternatives(number: &Comparison, all: &[Comparison]) -> Vec<(String, Vec<Value>)> {
    let mut found: BTreeMap<&String, Vec<Value>> = BTreeMap::new();
    for (name, own) in &number.entry.inputs {
        let values = found.entry(name).or_default();
        values.extend(number.entry.also.get(name).into_iter().flatten().cloned());
        // Only quantities with a unit in their name: a "part" or "step" of another computation is no alternative.
        let unit = name.contains('_');
        let others =
            all.iter().filter(|other| unit && !other.entry.of_table).filter_map(|other| other.entry.inputs.get(name));
        values.extend(others.filter(|value| as_number(value).is_some()).cloned());
        values.retain(|value| as_number(value) != as_number(own));
        values.dedup();
    }
    found.into_iter().map(|(name, values)| (name.clone(), values)).collect()
}

/// Explanation of a sum by terms that were left out.
pub(super) fn terms_left_out(number: &Comparison) -> Result<Option<String>> {
    let Some(terms) = number.entry.inputs.get("terms").and_then(Value::as_array) else { return Ok(None) };
    if terms.len() > 12 {
        return Ok(None);
    }
    // Try the fewest omitted terms first.
    let mut choices: Vec<usize> = (1..1usize << terms.len()).collect();
    choices.sort_by_key(|kept| std::cmp::Reverse(kept.count_ones()));
    for kept in choices {
        let some: Vec<Value> = terms
            .iter()
            .enumerate()
            .filter(|(index, _)| kept >> index & 1 == 1)
            .map(|(_, term)| term.clone())
            .collect();
        let left: Vec<String> = some.iter().filter_map(as_number).map(short).collect();
        let mut inputs = number.entry.inputs.clone();
        inputs.insert("terms".to_owned(), Value::Array(some));
        let value = compute(&number.entry.of, &Inputs(&inputs))?.value;
        // The terms are printed numbers too, so the last digit may differ.
        if (value - number.printed.value).abs() <= 2.0 * number.printed.last_digit() {
            return Ok(Some(format!(
                "{}; to within its last digit it is what {} of the {} terms give: {}",
                number.difference(),
                left.len(),
                terms.len(),
                left.join(" + ")
            )));
        }
    }
    Ok(None)
}

/// The value that one input would need for the printed number to result.
pub(super) fn input_needed(number: &Comparison) -> Result<Option<String>> {
    let mut needed = Vec::new();
    for (name, own) in &number.entry.inputs {
        let Some(own) = as_number(own).filter(|own| *own > 0.0) else { continue };
        let miss = |factor: f64| {
            let mut inputs = number.entry.inputs.clone();
            inputs.insert(name.clone(), Value::Float(own * factor));
            compute(&number.entry.of, &Inputs(&inputs)).map(|outcome| outcome.value - number.printed.value)
        };
        if let Some(factor) = root(miss) {
            needed.push((factor.ln().abs(), format!("{name} = {} in place of {own}", short(own * factor))));
        }
    }
    if needed.is_empty() || number.entry.of == "same" {
        return Ok(None);
    }
    // The two inputs with the smallest relative change.
    needed.sort_by(|one, other| one.0.total_cmp(&other.0));
    let needed: Vec<String> = needed.into_iter().take(2).map(|(_, said)| said).collect();
    Ok(Some(format!("it would take {}", needed.join(", or "))))
}

/// A factor between 0.01 and 100 at which `miss` is zero, the closest to 1 that a scan finds; `None` without a sign
/// change.
fn root(miss: impl Fn(f64) -> Result<f64>) -> Option<f64> {
    const PARTS: i32 = 40;
    let at = |part: i32| 10f64.powf(2.0 * f64::from(part) / f64::from(PARTS));
    let sign = |factor: f64| miss(factor).ok().map(f64::signum);
    // Scan from 1 outwards.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_of_a_linear_function_is_found() {
        let found = root(|factor| Ok(factor - 0.3)).unwrap();
        assert!((found - 0.3).abs() < 1e-9);
        assert!(root(|_| Ok(1.0)).is_none());
    }
}
