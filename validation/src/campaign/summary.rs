//! What became of many records.

use std::collections::BTreeMap;

use serde::Serialize;

use super::part::Job;
use super::score::Outcome;

/// Counts over the records of one line of a table.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// The line.
    pub group: String,
    /// Number of records.
    pub records: usize,
    /// First finding right, in parts of 1. Without a hidden cause, 0.
    pub first: f64,
    /// Every hidden cause named, in parts of 1.
    pub all_named: f64,
    /// No finding that isn't there, in parts of 1.
    pub nothing_extra: f64,
    /// The verdict fits, in parts of 1.
    pub verdict_right: f64,
    /// Ambiguous with the truth among the alternatives, in parts of 1.
    pub truth_among_alternatives: f64,
    /// Verdicts and their number.
    pub verdicts: BTreeMap<String, usize>,
    /// By cause and parameter.
    pub parameters: Vec<Accuracy>,
    /// Median over the records, of the held-out error over what the true spring leaves.
    pub held_out_ratio: Option<f64>,
    /// The same, 95 of 100 are below.
    pub held_out_ratio_95: Option<f64>,
    /// Median time of a diagnosis, in s of a processor.
    pub seconds: Option<f64>,
}

/// How well a parameter came out.
#[derive(Clone, Debug, Serialize)]
pub struct Accuracy {
    /// Of which cause.
    pub cause: &'static str,
    /// Its name.
    pub name: String,
    /// How often it was estimated.
    pub estimates: usize,
    /// Median of the relative error.
    pub median_error: f64,
    /// The least that was possible: median over the records, of those that have a bound.
    pub at_best: Option<f64>,
    /// How often the 95 % bounds held the truth, in parts of 1.
    pub covered: f64,
}

impl Summary {
    /// Of the outcomes of `jobs`, in one line for each group, in the order of the jobs.
    pub fn by_group(jobs: &[Job], outcomes: &[Outcome]) -> Vec<Self> {
        let mut groups: Vec<(&str, Vec<&Outcome>)> = Vec::new();
        for (job, outcome) in jobs.iter().zip(outcomes) {
            match groups.iter_mut().find(|(group, _)| *group == job.group) {
                Some((_, inside)) => inside.push(outcome),
                None => groups.push((&job.group, vec![outcome])),
            }
        }
        groups.into_iter().map(|(group, outcomes)| Self::of(group, &outcomes)).collect()
    }

    /// Of all outcomes in one.
    pub fn of(group: &str, outcomes: &[&Outcome]) -> Self {
        let mut verdicts = BTreeMap::new();
        for outcome in outcomes {
            *verdicts.entry(outcome.verdict.clone()).or_insert(0) += 1;
        }
        let ratios: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.held_out_ratio).collect();
        let share = |is: fn(&Outcome) -> bool| share(outcomes, |outcome| is(outcome));
        Self {
            group: group.to_owned(),
            records: outcomes.len(),
            first: share(Outcome::first_is_right),
            all_named: share(Outcome::all_named),
            nothing_extra: share(Outcome::nothing_extra),
            verdict_right: share(Outcome::verdict_is_right),
            truth_among_alternatives: share(|outcome| outcome.truth_among_alternatives),
            verdicts,
            parameters: accuracies(outcomes),
            held_out_ratio: quantile(&ratios, 0.5),
            held_out_ratio_95: quantile(&ratios, 0.95),
            seconds: quantile(&outcomes.iter().map(|outcome| outcome.seconds).collect::<Vec<_>>(), 0.5),
        }
    }
}

fn accuracies(outcomes: &[&Outcome]) -> Vec<Accuracy> {
    let mut found = BTreeMap::<_, Vec<_>>::new();
    for estimate in outcomes.iter().flat_map(|outcome| &outcome.parameters) {
        found.entry((estimate.cause, estimate.name.clone())).or_default().push(estimate);
    }
    let accuracy = |((cause, name), estimates): ((crate::hidden::Cause, String), Vec<_>)| {
        let estimates: Vec<&super::score::Estimate> = estimates;
        let errors: Vec<f64> = estimates.iter().map(|estimate| estimate.error).collect();
        Accuracy {
            cause: cause.name(),
            name,
            estimates: estimates.len(),
            median_error: quantile(&errors, 0.5).unwrap_or(f64::NAN),
            at_best: quantile(&estimates.iter().filter_map(|estimate| estimate.at_best).collect::<Vec<_>>(), 0.5),
            covered: share(&estimates, |estimate| estimate.covered),
        }
    };
    found.into_iter().map(accuracy).collect()
}

fn share<T>(all: &[T], is: impl Fn(&T) -> bool) -> f64 {
    all.iter().filter(|one| is(one)).count() as f64 / all.len().max(1) as f64
}

/// The value that a part of the values is at most; none of none.
pub fn quantile(values: &[f64], part: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    Some(sorted[(part * last as f64).round() as usize])
}
