//! Every printed number compared with the computed one: the answer of `vsj reproduce`.

use anyhow::{Context, Result};
use serde::Serialize;

use crate::reproduce::comparison::Comparison;
use crate::reproduce::compute::compute;
use crate::reproduce::explain::explain;
use crate::reproduce::inputs::Inputs;
use crate::reproduce::printed::{Printed, Rule};
use crate::reproduce::source::{self, BearsOn};

/// One printed number.
#[derive(Clone, Debug, Serialize)]
pub struct Item {
    /// Where it is printed.
    #[serde(rename = "where")]
    pub place: String,
    /// As a number.
    pub printed: f64,
    /// What comes out.
    pub computed: f64,
    /// True if it is what was printed, to the printed precision.
    pub agrees: bool,
    /// The likeliest explanation of a disagreement, with its evidence.
    pub note: Option<String>,
    /// As it is printed.
    pub text: String,
    /// Unit of both.
    pub unit: String,
    /// What rests on it.
    pub bears_on: BearsOn,
    /// True if it was measured: then it is compared with what other measured numbers lead to expect.
    pub measured: bool,
}

/// The whole answer of `vsj reproduce --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Every number, those of tables first.
    pub items: Vec<Item>,
    /// How many agree.
    pub agree: usize,
    /// How many do not.
    pub disagree: usize,
    /// Groups whose numbers are cut off, not rounded; found by counting.
    pub truncated_groups: Vec<String>,
}

/// Computes, judges and explains everything.
///
/// # Errors
/// If a data file that was built in is damaged or asks for a computation that does not exist.
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

/// Finds out, group by group, whether numbers were rounded or cut off; returns the groups that were cut off.
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
        // One number is no habit.
        count(Rule::Truncated) > count(Rule::Rounded) + 1
    });
    for number in comparisons {
        if groups.contains(&number.entry.group) {
            number.rule = Rule::Truncated;
        }
    }
    groups
}
