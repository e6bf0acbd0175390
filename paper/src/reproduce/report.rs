//! Every printed number compared with the computed one: the answer of `vsj reproduce`.

use anyhow::{Context, Result};
use serde::Serialize;

use crate::reproduce::comparison::Comparison;
use crate::reproduce::compute::compute;
use crate::reproduce::explain::explain;
use crate::reproduce::inputs::Inputs;
use crate::reproduce::printed::{Printed, Rule};
use crate::reproduce::source::{self, BearsOn};

/// One printed number compared with the computed one.
#[derive(Clone, Debug, Serialize)]
pub struct Item {
    /// Place in the report.
    #[serde(rename = "where")]
    pub place: String,
    /// The printed value.
    pub printed: f64,
    /// The computed value, or the predicted one of a measured number.
    pub computed: f64,
    /// True if printed and computed agree to the printed precision.
    pub agrees: bool,
    /// The most likely explanation of a disagreement, with its evidence.
    pub note: Option<String>,
    /// The number as printed.
    pub text: String,
    /// Unit of both values.
    pub unit: String,
    /// What depends on the number.
    pub bears_on: BearsOn,
    /// True if the number was measured; it is then compared with the prediction of other measured numbers.
    pub measured: bool,
}

/// The answer of `vsj reproduce --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// All numbers, those of tables first.
    pub items: Vec<Item>,
    /// Number of agreements.
    pub agree: usize,
    /// Number of disagreements.
    pub disagree: usize,
    /// Groups of numbers that were truncated instead of rounded, as more of their digits then agree.
    pub truncated_groups: Vec<String>,
}

/// Computes, compares and explains all printed numbers.
///
/// # Errors
/// If a built-in data file is damaged or names an unknown computation.
pub fn reproduce() -> Result<Report> {
    let mut comparisons = Vec::new();
    for entry in source::entries()? {
        let printed = Printed::new(&entry.printed).with_context(|| entry.place.clone())?;
        let outcome = compute(&entry.of, &Inputs(&entry.inputs)).with_context(|| entry.place.clone())?;
        comparisons.push(Comparison { entry, printed, outcome, rule: Rule::Rounded, agrees: false });
    }
    let truncated_groups = find_rules(&mut comparisons);
    for number in &mut comparisons {
        let Comparison { entry, printed, outcome, rule, .. } = number;
        number.agrees = match outcome.expected {
            Some((low, high)) => (low..=high).contains(&printed.value),
            None => printed.agrees(outcome.value, entry.relation, *rule),
        };
    }
    let items: Vec<Item> = comparisons
        .iter()
        .map(|number| {
            let note = if number.agrees { None } else { Some(explain(number, &comparisons)?) };
            Ok(Item {
                place: number.entry.place.clone(),
                printed: number.printed.value,
                computed: number.outcome.value,
                agrees: number.agrees,
                note,
                text: number.entry.printed.clone(),
                unit: number.entry.unit.clone(),
                bears_on: number.entry.bears_on,
                measured: number.outcome.expected.is_some(),
            })
        })
        .collect::<Result<_>>()?;
    let agree = items.iter().filter(|item| item.agrees).count();
    Ok(Report { agree, disagree: items.len() - agree, items, truncated_groups })
}

/// Decides for each group whether its numbers were rounded or truncated; returns the truncated groups.
fn find_rules(comparisons: &mut [Comparison]) -> Vec<String> {
    let mut groups: Vec<String> = comparisons.iter().map(|number| number.entry.group.clone()).collect();
    groups.dedup();
    groups.sort();
    groups.dedup();
    groups.retain(|group| {
        let count = |rule: Rule| {
            let of_group = comparisons.iter().filter(|number| number.entry.group == *group);
            of_group.filter(|n| n.printed.agrees(n.outcome.value, n.entry.relation, rule)).count()
        };
        // A single number is not enough evidence.
        count(Rule::Truncated) > count(Rule::Rounded) + 1
    });
    for number in comparisons {
        if groups.contains(&number.entry.group) {
            number.rule = Rule::Truncated;
        }
    }
    groups
}
