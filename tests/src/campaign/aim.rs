//! What is asked of the diagnosis, and whether it came out.

use std::fmt::{self, Display};
use std::process::ExitCode;

use serde::Serialize;

use super::ladder::Climb;
use super::score::Outcome;
use super::summary::Summary;

/// One thing that is asked.
#[derive(Clone, Debug, Serialize)]
pub struct Aim {
    /// Of what.
    pub what: String,
    /// At least.
    pub low: f64,
    /// At most.
    pub high: f64,
    /// What came out.
    pub found: f64,
}

impl Aim {
    fn at_least(what: impl Into<String>, low: f64, found: f64) -> Self {
        Self { what: what.into(), low, high: f64::INFINITY, found }
    }

    /// Found at most `high`.
    pub fn at_most(what: impl Into<String>, high: f64, found: f64) -> Self {
        Self { what: what.into(), low: f64::NEG_INFINITY, high, found }
    }

    /// It came out. What is not a number did not.
    pub fn is_met(&self) -> bool {
        (self.low..=self.high).contains(&self.found)
    }
}

impl Display for Aim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, low, high, found } = self;
        let aim = match (low.is_finite(), high.is_finite()) {
            (true, true) => format!("{low} to {high}"),
            (true, false) => format!("at least {low}"),
            _ => format!("at most {high}"),
        };
        write!(f, "{what}: {found:.3}, asked for {aim}: {}", if self.is_met() { "met" } else { "NOT MET" })
    }
}

/// How a command ends that asked for aims: `met` is whether all were.
pub fn exit_code(met: anyhow::Result<bool>) -> ExitCode {
    match met {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn all(outcomes: &[Outcome]) -> Summary {
    Summary::of("all", &outcomes.iter().collect::<Vec<_>>())
}

/// One effect, plain to see.
pub fn singles(outcomes: &[Outcome]) -> Vec<Aim> {
    let summary = all(outcomes);
    let covered = outcomes.iter().flat_map(|outcome| &outcome.parameters).map(|estimate| f64::from(estimate.covered));
    let covered: Vec<f64> = covered.collect();
    let mut aims = vec![
        Aim::at_least("first finding is the hidden cause", 0.99, summary.first),
        Aim::at_least("no other finding", 0.99, summary.nothing_extra),
        Aim::at_least("verdict explained or ambiguous", 0.99, summary.verdict_right),
        Aim { what: "95 % bounds hold the truth".into(), low: 0.9, high: 0.99, found: mean(&covered) },
        Aim::at_most("held-out error over what the true spring leaves, median", 1.1, or_nan(summary.held_out_ratio)),
    ];
    let error = |a: &super::summary::Accuracy| {
        Aim::at_most(format!("median error, {} {}", a.cause, a.name), 0.05, a.median_error)
    };
    aims.extend(summary.parameters.iter().map(error));
    aims
}

/// The paper's spring.
pub fn nulls(outcomes: &[Outcome]) -> Vec<Aim> {
    let summary = all(outcomes);
    vec![
        Aim::at_most("records without an effect that get a finding", 0.01, 1.0 - summary.nothing_extra),
        Aim::at_most("records without an effect that are not called consistent", 0.01, 1.0 - summary.verdict_right),
    ]
}

/// Two effects of different blocks.
pub fn pairs(outcomes: &[Outcome]) -> Vec<Aim> {
    several("both causes named", 0.95, outcomes)
}

/// Three effects of different blocks.
pub fn triples(outcomes: &[Outcome]) -> Vec<Aim> {
    several("all three causes named", 0.85, outcomes)
}

fn several(what: &str, named: f64, outcomes: &[Outcome]) -> Vec<Aim> {
    let summary = all(outcomes);
    vec![
        Aim::at_least(what, named, summary.all_named),
        Aim::at_least("no other finding", 0.95, summary.nothing_extra),
        Aim::at_least("verdict explained or ambiguous", 0.95, summary.verdict_right),
        Aim::at_most("held-out error over what the true spring leaves, median", 1.1, or_nan(summary.held_out_ratio)),
    ]
}

/// The smallest effect that is named over the smallest that can be detected.
pub fn small(climbs: &[Climb]) -> Vec<Aim> {
    let aim = |climb: &Climb| {
        let ratio = climb.ratio.unwrap_or(f64::INFINITY);
        Aim::at_most(format!("named over detectable size, {}", climb.cause), 1.5, ratio)
    };
    climbs.iter().map(aim).collect()
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
    fn nothing_found_meets_no_aim_but_that_of_the_nulls() {
        assert!(singles(&[]).iter().all(|aim| !aim.is_met()));
        let aim = Aim::at_most("x", 1.1, f64::NAN);
        assert!(!aim.is_met() && aim.to_string().ends_with("asked for at most 1.1: NOT MET"));
    }
}
