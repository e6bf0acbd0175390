//! Counts and medians over many scored records.

use std::collections::BTreeMap;

use serde::Serialize;

use super::part::Job;
use super::score::{Estimate, Outcome};
use crate::ground_truth::Cause;
use crate::statistics::{median, quantile};

/// Counts over the records of one table row.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Name of the row.
    pub group: String,
    /// Number of records.
    pub records: usize,
    /// Fraction of records whose first finding is a true cause; 0 without an effect.
    pub first: f64,
    /// Fraction of records of which every true cause is named.
    pub all_named: f64,
    /// Fraction of records without a false finding.
    pub nothing_extra: f64,
    /// Fraction of records with a correct verdict.
    pub verdict_right: f64,
    /// Fraction of records that are ambiguous with the true causes among the alternatives.
    pub truth_among_alternatives: f64,
    /// Number of records by verdict.
    pub verdicts: BTreeMap<String, usize>,
    /// Accuracy of every estimated parameter.
    pub parameters: Vec<Accuracy>,
    /// Median over the records of the held-out error, relative to the error of the true spring.
    pub held_out_ratio: Option<f64>,
    /// 95 % quantile of that ratio.
    pub held_out_ratio_95: Option<f64>,
    /// Median CPU time of a diagnosis, in s.
    pub seconds: Option<f64>,
}

/// Accuracy of one parameter over many records.
#[derive(Clone, Debug, Serialize)]
pub struct Accuracy {
    /// Cause that the parameter belongs to.
    pub cause: &'static str,
    /// Name of the parameter.
    pub name: String,
    /// Number of estimates.
    pub estimates: usize,
    /// Median of the absolute relative error.
    pub median_error: f64,
    /// Median of the Cramer-Rao bound, over the records that have one.
    pub at_best: Option<f64>,
    /// Fraction of the 95 % intervals that contain the true value.
    pub covered: f64,
}

impl Summary {
    /// Summaries of the outcomes of `jobs`, one for each group, in the order of the jobs.
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

    /// Summary of all outcomes in one row named `group`.
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
            held_out_ratio: median(&ratios),
            held_out_ratio_95: quantile(&ratios, 0.95),
            seconds: median(&outcomes.iter().map(|outcome| outcome.seconds).collect::<Vec<_>>()),
        }
    }
}

fn accuracies(outcomes: &[&Outcome]) -> Vec<Accuracy> {
    let mut found = BTreeMap::<_, Vec<_>>::new();
    for estimate in outcomes.iter().flat_map(|outcome| &outcome.parameters) {
        found.entry((estimate.cause, estimate.name.clone())).or_default().push(estimate);
    }
    let accuracy = |((cause, name), estimates): ((Cause, String), Vec<_>)| {
        let estimates: Vec<&Estimate> = estimates;
        let errors: Vec<f64> = estimates.iter().map(|estimate| estimate.error).collect();
        Accuracy {
            cause: cause.name(),
            name,
            estimates: estimates.len(),
            median_error: median(&errors).unwrap_or(f64::NAN),
            at_best: median(&estimates.iter().filter_map(|estimate| estimate.at_best).collect::<Vec<_>>()),
            covered: share(&estimates, |estimate| estimate.covered),
        }
    };
    found.into_iter().map(accuracy).collect()
}

fn share<T>(all: &[T], is: impl Fn(&T) -> bool) -> f64 {
    all.iter().filter(|one| is(one)).count() as f64 / all.len().max(1) as f64
}
