//! Every printed number of the source report that can be computed again, beside what comes out.
//!
//! Printed numbers live in `data/` ([`source`]), with their place, and with the name and the inputs of the computation that
//! gives them ([`compute`], [`models`], [`readings`]). Whether one agrees is judged by its own digits ([`printed`]); why it
//! does not is asked of general explanations (`explain`, `slips`, `inputs`). No number is known to this code.

pub mod compute;
mod explain;
mod inputs;
pub mod models;
pub mod page;
pub mod printed;
pub mod readings;
mod slips;
pub mod source;

use anyhow::{Context, Result};
use serde::Serialize;

use compute::{Inputs, Outcome};
use printed::{Printed, Rule};
use source::{BearsOn, Entry};

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

/// A number with what was computed for it.
pub(crate) struct Judged {
    pub(crate) entry: Entry,
    pub(crate) printed: Printed,
    pub(crate) outcome: Outcome,
    pub(crate) rule: Rule,
    pub(crate) agrees: bool,
}

/// Computes, judges and explains everything.
///
/// # Errors
/// If a data file that was built in is damaged or asks for a computation that does not exist.
pub fn reproduce() -> Result<Report> {
    let mut judged = Vec::new();
    for entry in source::entries()? {
        let printed = Printed::new(&entry.printed).with_context(|| entry.place.clone())?;
        let outcome = compute::compute(&entry.of, &Inputs(&entry.inputs)).with_context(|| entry.place.clone())?;
        judged.push(Judged { entry, printed, outcome, rule: Rule::Rounded, agrees: false });
    }
    let truncated_groups = find_rules(&mut judged);
    for number in &mut judged {
        let Judged { entry, printed, outcome, rule, .. } = number;
        number.agrees = match outcome.expected {
            Some((low, high)) => (low..=high).contains(&printed.value),
            None => printed.agrees(outcome.value, entry.relation, *rule),
        };
    }
    let items: Vec<Item> = judged
        .iter()
        .map(|number| {
            let note = if number.agrees { None } else { Some(explain::explain(number, &judged)?) };
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
fn find_rules(judged: &mut [Judged]) -> Vec<String> {
    let mut groups: Vec<String> = judged.iter().map(|number| number.entry.group.clone()).collect();
    groups.dedup();
    groups.sort();
    groups.dedup();
    groups.retain(|group| {
        let count = |rule: Rule| {
            let of_group = judged.iter().filter(|number| number.entry.group == *group);
            of_group.filter(|n| n.printed.agrees(n.outcome.value, n.entry.relation, rule)).count()
        };
        // One number is no habit.
        count(Rule::Truncated) > count(Rule::Rounded) + 1
    });
    for number in judged {
        if groups.contains(&number.entry.group) {
            number.rule = Rule::Truncated;
        }
    }
    groups
}

/// A number with six digits.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        let decimals = (5 - value.abs().max(1e-3).log10().floor() as i32).clamp(0, 8) as usize;
        let text = format!("{value:.decimals$}");
        return if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    }
    let text = format!("{value:.5e}");
    match text.split_once('e') {
        Some((digits, exponent)) => format!("{}e{exponent}", digits.trim_end_matches('0').trim_end_matches('.')),
        // Not finite.
        None => text,
    }
}
