//! Acceptance criteria of the campaign's parts.

use super::score::Outcome;
use super::sensitivity::Sensitivity;
use super::summary::{Accuracy, Summary};
use crate::criterion::Criterion;

fn all(outcomes: &[Outcome]) -> Summary {
    Summary::of("all", &outcomes.iter().collect::<Vec<_>>())
}

/// Criteria of records with one effect of full size.
pub fn singles(outcomes: &[Outcome]) -> Vec<Criterion> {
    let summary = all(outcomes);
    let covered = outcomes.iter().flat_map(|outcome| &outcome.parameters).map(|estimate| f64::from(estimate.covered));
    let covered: Vec<f64> = covered.collect();
    let mut criteria = vec![
        Criterion::at_least("first finding is the hidden cause", 0.99, summary.first),
        Criterion::at_least("no other finding", 0.99, summary.nothing_extra),
        Criterion::at_least("verdict explained or ambiguous", 0.99, summary.verdict_right),
        Criterion { what: "95 % bounds contain the true value".into(), low: 0.9, high: 0.99, found: mean(&covered) },
        Criterion::at_most("held-out error relative to the true spring, median", 1.1, or_nan(summary.held_out_ratio)),
    ];
    let error =
        |a: &Accuracy| Criterion::at_most(format!("median error, {} {}", a.cause, a.name), 0.05, a.median_error);
    criteria.extend(summary.parameters.iter().map(error));
    criteria
}

/// Criteria of records without an effect.
pub fn nulls(outcomes: &[Outcome]) -> Vec<Criterion> {
    let summary = all(outcomes);
    vec![
        Criterion::at_most("records without an effect that get a finding", 0.01, 1.0 - summary.nothing_extra),
        Criterion::at_most(
            "records without an effect that are not called consistent",
            0.01,
            1.0 - summary.verdict_right,
        ),
    ]
}

/// Criteria of records with two effects of different blocks.
pub fn pairs(outcomes: &[Outcome]) -> Vec<Criterion> {
    several("both causes named", 0.95, outcomes)
}

/// Criteria of records with three effects of different blocks.
pub fn triples(outcomes: &[Outcome]) -> Vec<Criterion> {
    several("all three causes named", 0.85, outcomes)
}

fn several(what: &str, named: f64, outcomes: &[Outcome]) -> Vec<Criterion> {
    let summary = all(outcomes);
    vec![
        Criterion::at_least(what, named, summary.all_named),
        Criterion::at_least("no other finding", 0.95, summary.nothing_extra),
        Criterion::at_least("verdict explained or ambiguous", 0.95, summary.verdict_right),
        Criterion::at_most("held-out error relative to the true spring, median", 1.1, or_nan(summary.held_out_ratio)),
    ]
}

/// Criteria of the smallest effect that is named, relative to the smallest that can be detected.
pub fn small(sensitivities: &[Sensitivity]) -> Vec<Criterion> {
    let criterion = |it: &Sensitivity| {
        let ratio = it.ratio.unwrap_or(f64::INFINITY);
        Criterion::at_most(format!("named size relative to detectable size, {}", it.cause), 1.5, ratio)
    };
    sensitivities.iter().map(criterion).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn or_nan(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_campaign_meets_no_criterion_on_single_effects() {
        assert!(singles(&[]).iter().all(|criterion| !criterion.is_met()));
    }
}
