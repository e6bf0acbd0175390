//! Explanations of a disagreement between printed and computed number, tried from the most to the least specific.
//!
//! A misprint must give the printed digits exactly. Another input must be printed in the report for the same quantity.
//! If nothing fits, the value that one input would need is stated, without claiming it.

use anyhow::Result;
use toml::Value;

use crate::reproduce::comparison::Comparison;
use crate::reproduce::inputs::number as as_number;
use crate::reproduce::other_inputs::{input_needed, other_value, terms_left_out};
use crate::reproduce::printed::Relation;
use crate::reproduce::slips::{digit_of_a_reading, simple_factor, simulated, slip_of_the_pen};

/// The most likely explanation of a disagreement, with its evidence.
pub(crate) fn explain(number: &Comparison, all: &[Comparison]) -> Result<String> {
    let mut said: Vec<String> =
        [&number.entry.because, &number.outcome.evidence].into_iter().flatten().cloned().collect();
    said.extend(distance_in_standard_errors(number));
    said.extend(first_explanation(number, all)?);
    said.extend(deviations_of_siblings(number, all));
    if number.outcome.standard_error.is_some() {
        let carried = |place| format!("{place} was computed with it: it was so before it was printed");
        said.extend(used_as_printed(number, all).map(carried));
    }
    Ok(said.iter().map(|sentence| capital(sentence)).collect::<Vec<_>>().join(". "))
}

fn capital(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// Distance of a fitted number from the printed one, in standard errors of the fit.
fn distance_in_standard_errors(number: &Comparison) -> Option<String> {
    let off = (number.printed.value - number.outcome.value) / number.outcome.standard_error?;
    let says = if off.abs() > 3.0 {
        "more than their scatter leaves open"
    } else {
        "within their scatter, so other readings or another fit of the same spring may have given it"
    };
    Some(format!("printed is {off:+.1} standard errors off: {says}"))
}

/// Place of a number that agrees and was computed with this one as printed, which rules out a misprint.
fn used_as_printed<'a>(number: &Comparison, all: &'a [Comparison]) -> Option<&'a str> {
    if number.printed.significant_digits() < 4 {
        return None;
    }
    let equal = |value: &Value| as_number(value) == Some(number.printed.value);
    let uses = |other: &&Comparison| {
        other.agrees
            && !other.entry.of_table
            && other.entry.of != "same"
            && other.entry.inputs.values().any(|input| match input {
                Value::Array(list) => list.iter().any(equal),
                single => equal(single),
            })
    };
    all.iter().find(uses).map(|other| other.entry.place.as_str())
}

/// The first explanation that fits.
fn first_explanation(number: &Comparison, all: &[Comparison]) -> Result<Option<String>> {
    if number.entry.relation != Relation::Equal && number.entry.relation != Relation::About {
        return Ok(Some(other_value(number, all)?.unwrap_or_else(|| number.difference())));
    }
    if number.outcome.expected.is_some() {
        // A deviation shared with other readings is no misprint of one digit.
        let alone = !number.outcome.persists && !deviate_alike(number, &siblings(number, all));
        return Ok(alone.then(|| digit_of_a_reading(number)).flatten());
    }
    if let Some(slip) =
        simulated(number, all).or_else(|| slip_of_the_pen(number, used_as_printed(number, all).is_some()))
    {
        return Ok(Some(slip));
    }
    if let Some(other) = other_value(number, all)? {
        return Ok(Some(other));
    }
    if let Some(left_out) = terms_left_out(number)? {
        return Ok(Some(left_out));
    }
    let what = simple_factor(number).unwrap_or_else(|| number.difference());
    Ok(Some(match input_needed(number)? {
        Some(needed) => format!("{what}; {needed}"),
        None => what,
    }))
}

/// Other measured numbers of the same table, at the same voltage under another force.
fn siblings<'a>(number: &Comparison, all: &'a [Comparison]) -> Vec<&'a Comparison> {
    let same = |other: &&Comparison| {
        number.outcome.expected.is_some()
            && other.entry.group == number.entry.group
            && other.entry.place != number.entry.place
            && other.entry.inputs.get("voltage_v") == number.entry.inputs.get("voltage_v")
            && other.entry.inputs.contains_key("force_un")
    };
    all.iter().filter(same).collect()
}

/// Relative deviation of the printed from the computed number.
fn deviation(number: &Comparison) -> f64 {
    number.printed.value / number.outcome.value - 1.0
}

/// True if there are other numbers and their deviations agree with this one within 5 percentage points.
fn deviate_alike(number: &Comparison, siblings: &[&Comparison]) -> bool {
    !siblings.is_empty() && siblings.iter().all(|like| (deviation(like) - deviation(number)).abs() < 0.05)
}

/// The deviations of other numbers at the same voltage, in words.
fn deviations_of_siblings(number: &Comparison, all: &[Comparison]) -> Option<String> {
    let siblings = siblings(number, all);
    if siblings.is_empty() {
        return None;
    }
    let others: Vec<String> = siblings.iter().map(|like| format!("{:+.1} %", 1e2 * deviation(like))).collect();
    Some(format!(
        "it is off by {:+.1} %, at the same voltage the other by {}: {}",
        1e2 * deviation(number),
        others.join(", "),
        if deviate_alike(number, &siblings) {
            "a common cause, such as another sample or mounting"
        } else {
            "this one alone"
        }
    ))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::reproduce::compute::compute;
    use crate::reproduce::inputs::Inputs;
    use crate::reproduce::outcome::Outcome;
    use crate::reproduce::printed::Printed;
    use crate::reproduce::printed::Rule;
    use crate::reproduce::source::{BearsOn, Entry};

    fn comparison(printed: &str, of: &str, inputs: &str, also: &str) -> Comparison {
        let inputs: BTreeMap<String, Value> = toml::from_str(inputs).unwrap();
        let entry = Entry {
            place: "here".to_owned(),
            printed: printed.to_owned(),
            unit: String::new(),
            relation: Relation::Equal,
            of: of.to_owned(),
            inputs,
            also: toml::from_str(also).unwrap(),
            because: None,
            bears_on: BearsOn::Result,
            group: "here".to_owned(),
            of_table: false,
        };
        let outcome: Outcome = compute(of, &Inputs(&entry.inputs)).unwrap();
        Comparison { printed: Printed::new(printed).unwrap(), outcome, rule: Rule::Rounded, agrees: false, entry }
    }

    /// Each kind of misprint, made deliberately, gets its own explanation.
    #[test]
    fn each_kind_of_misprint_is_identified() {
        let product = "factors = [3.0, 4.1234]";
        for (printed, of, inputs, also, expected) in [
            ("12.73", "product", product, "", "digits 3 and 7 swapped"),
            ("12.57", "product", product, "", "one digit of 4 wrong, 5 in place of 3"),
            ("1.237", "product", product, "", "10^-1 of"),
            ("1.2370e3", "product", product, "", "printed is 10^2 of"),
            ("0.08084", "product", product, "", "the reciprocal"),
            ("37.11", "product", product, "", "Printed is 3 times the computed"),
            ("4.1233", "sum", "terms = [3.0, 4.1233, 1.5]", "", "what 1 of the 3 terms give: 4.1233"),
            (
                "15.708",
                "quotient",
                "dividend = 31.416\ndivisor = 3.0",
                "divisor = [2.0]",
                "With divisor = 2.0 in place of 3.0 it would agree",
            ),
            ("8.111", "quotient", "dividend = 31.416\ndivisor = 3.0", "", "it would take dividend = 24.333"),
            ("77.7", "product", product, "", "Printed is +528.1 % off"),
        ] {
            let number = comparison(printed, of, inputs, also);
            let said = explain(&number, &[]).unwrap();
            assert!(said.contains(expected), "{printed}: {said}");
        }
    }

    #[test]
    fn a_reading_explained_by_one_misread_digit_names_that_digit() {
        let mut number = comparison("331", "sum", "terms = [349]", "");
        number.outcome.expected = Some((343.0, 355.0));
        let said = digit_of_a_reading(&number).unwrap();
        assert!(said.starts_with("one digit misread would explain it: 351 (by chance one fits in "), "{said}");
        // Windows of width 6 around numbers that are 10 apart cover six tenths of all places; near 331 they cover more.
        let percent: f64 = said.split(' ').rev().nth(1).unwrap().parse().unwrap();
        assert!((60.0..75.0).contains(&percent), "{said}");
        number.outcome.expected = Some((445.0, 455.0));
        assert!(digit_of_a_reading(&number).unwrap().starts_with("no single digit"));
    }
}
