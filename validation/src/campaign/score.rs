//! What became of one record.

use std::collections::BTreeMap;

use cpu_time::ThreadTime;
use serde::{Deserialize, Serialize};

use super::bound;
use super::seam::Diagnose;
use crate::hidden::{Cause, Hidden};

/// What of a report is scored.
#[derive(Debug, Deserialize)]
pub(super) struct Report {
    pub(super) verdict: String,
    pub(super) findings: Vec<Finding>,
    #[serde(default)]
    pub(super) alternatives: Vec<Vec<String>>,
    extended: Option<Extended>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Finding {
    pub(super) cause: String,
    #[serde(default)]
    parameters: BTreeMap<String, Parameter>,
}

#[derive(Debug, Deserialize)]
struct Parameter {
    value: Option<f64>,
    low: Option<f64>,
    high: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Extended {
    held_out_rmse: Option<f64>,
}

/// What was hidden, what was named.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// Of the record.
    pub seed: u64,
    /// The causes that are in it.
    pub hidden: Vec<&'static str>,
    /// The verdict; `failed` if there was no report.
    pub verdict: String,
    /// The causes that were found, in order.
    pub found: Vec<String>,
    /// The verdict is `ambiguous`, and one of the alternatives is the truth.
    pub truth_among_alternatives: bool,
    /// Of every cause that was rightly found.
    pub parameters: Vec<Estimate>,
    /// Held-out error of the extended model over what the true spring leaves.
    pub held_out_ratio: Option<f64>,
    /// Of a processor, for the diagnosis, in s.
    pub seconds: f64,
    /// Why there was no report.
    pub failure: Option<String>,
}

/// A parameter of a finding beside the truth.
#[derive(Clone, Debug, Serialize)]
pub struct Estimate {
    /// Of which cause.
    pub cause: Cause,
    /// Its name.
    pub name: String,
    /// In the record.
    pub truth: f64,
    /// As found; none if the finding lacks it.
    pub value: Option<f64>,
    /// Relative error, absolute; infinite where the finding lacks the value.
    pub error: f64,
    /// The truth lies within the finding's 95 % bounds.
    pub covered: bool,
    /// The least median of the error that is possible in this record, where there is such a bound.
    pub at_best: Option<f64>,
}

impl Outcome {
    /// Has a record diagnosed and scores the answer.
    pub fn of(hidden: &Hidden, diagnose: &Diagnose<'_>) -> Self {
        let start = ThreadTime::now();
        let answer =
            diagnose(hidden).and_then(|report| serde_json::from_value::<Report>(report).map_err(anyhow::Error::from));
        let seconds = start.elapsed().as_secs_f64();
        let names: Vec<_> = hidden.effects.iter().map(|effect| effect.cause.name()).collect();
        let mut outcome = Self {
            seed: hidden.seed,
            hidden: names,
            verdict: "failed".to_owned(),
            found: Vec::new(),
            truth_among_alternatives: false,
            parameters: Vec::new(),
            held_out_ratio: None,
            seconds,
            failure: None,
        };
        let report = match answer {
            Ok(report) => report,
            Err(error) => {
                outcome.failure = Some(format!("{error:#}"));
                return outcome;
            }
        };
        let same = |set: &Vec<String>| {
            set.len() == outcome.hidden.len() && outcome.hidden.iter().all(|name| set.iter().any(|s| s == name))
        };
        outcome.truth_among_alternatives = report.verdict == "ambiguous" && report.alternatives.iter().any(same);
        outcome.parameters = report.findings.iter().flat_map(|finding| estimates(hidden, finding)).collect();
        outcome.held_out_ratio = report.extended.and_then(|e| e.held_out_rmse).map(|rmse| rmse / hidden.floor_rmse());
        outcome.found = report.findings.into_iter().map(|finding| finding.cause).collect();
        outcome.verdict = report.verdict;
        outcome
    }

    /// The finding that explains most is one of the hidden causes.
    pub fn first_is_right(&self) -> bool {
        self.found.first().is_some_and(|first| self.hidden.contains(&first.as_str()))
    }

    /// Every hidden cause was found.
    pub fn all_named(&self) -> bool {
        self.failure.is_none() && self.hidden.iter().all(|name| self.found.iter().any(|found| found == name))
    }

    /// The verdict fits what is hidden: nothing, or something that has a name.
    pub fn verdict_is_right(&self) -> bool {
        let right: &[&str] = if self.hidden.is_empty() { &["consistent"] } else { &["explained", "ambiguous"] };
        right.contains(&self.verdict.as_str())
    }

    /// Nothing was found that isn't there.
    pub fn nothing_extra(&self) -> bool {
        self.failure.is_none() && self.found.iter().all(|found| self.hidden.contains(&found.as_str()))
    }
}

/// Every parameter of a finding that is right in its cause; those of the contract even if they are missing.
fn estimates(hidden: &Hidden, finding: &Finding) -> Vec<Estimate> {
    let Some(cause) = Cause::named(&finding.cause) else { return Vec::new() };
    let missing = cause.facts().parameters.iter().filter(|&&name| !finding.parameters.contains_key(name));
    let names = finding.parameters.keys().map(String::as_str).chain(missing.copied());
    names
        .filter_map(|name| {
            let (truth, scale) = hidden.true_value(cause, name)?;
            let found = finding.parameters.get(name);
            let value = found.and_then(|found| found.value);
            let covered = found.is_some_and(|found| {
                found.low.is_some_and(|low| low <= truth) && found.high.is_some_and(|high| truth <= high)
            });
            let error = value.map_or(f64::INFINITY, |value| ((value - truth) / scale).abs());
            let at_best = bound::median_error(hidden, cause, name);
            Some(Estimate { cause, name: name.to_owned(), truth, value, error, covered, at_best })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::hidden::record::Recipe;

    fn report(cause: &str, parameters: serde_json::Value) -> serde_json::Value {
        json!({"verdict": "explained", "findings": [{"cause": cause, "parameters": parameters}],
            "alternatives": [], "extended": {"held_out_rmse": 1.0}})
    }

    #[test]
    fn a_right_answer_scores_and_a_wrong_one_does_not() {
        let hidden = Recipe::of(&[Cause::GainError]).draw(1);
        let (gain, _) = hidden.true_value(Cause::GainError, "gain").unwrap();
        let right = json!({"gain": {"value": gain * 1.02, "low": gain * 1.01, "high": gain * 1.03}});
        let outcome = Outcome::of(&hidden, &|_| Ok(report("gain-error", right.clone())));
        assert!(
            outcome.first_is_right() && outcome.all_named() && outcome.nothing_extra() && outcome.verdict_is_right()
        );
        assert!((outcome.parameters[0].error - 0.02).abs() < 1e-9 && !outcome.parameters[0].covered);
        assert!((outcome.held_out_ratio.unwrap() - 1.0).abs() < 0.1);

        let outcome = Outcome::of(&hidden, &|_| Ok(report("drift", json!({}))));
        assert!(!outcome.first_is_right() && !outcome.all_named() && !outcome.nothing_extra());
        let outcome = Outcome::of(&hidden, &|_| Ok(report("gain-error", json!({}))));
        assert!(outcome.parameters[0].error.is_infinite(), "a parameter that is missing is no estimate");
        let outcome = Outcome::of(&hidden, &|_| anyhow::bail!("no"));
        assert!(!outcome.all_named() && !outcome.nothing_extra() && !outcome.verdict_is_right());
        let null = Recipe::of(&[]).draw(1);
        let unsure = Outcome::of(&null, &|_| Ok(json!({"verdict": "unexplained", "findings": []})));
        assert!(unsure.nothing_extra() && !unsure.verdict_is_right());
    }

    #[test]
    fn a_static_curve_is_scored_at_the_voltage_in_the_parameters_name() {
        let hidden = Recipe::of(&[Cause::StaticNonlinearity]).draw(1);
        let at = hidden.effects[0].law().unwrap().at(250.0);
        let curve = json!({"at_250_v": {"value": at, "low": at - 1.0, "high": at + 1.0}});
        let outcome = Outcome::of(&hidden, &|_| Ok(report("static-nonlinearity", curve.clone())));
        assert!(outcome.parameters[0].error < 1e-9 && outcome.parameters[0].covered);
        let truth = hidden.effects[0].law().unwrap().at(99.8);
        assert_eq!(hidden.true_value(Cause::StaticNonlinearity, "at_99.8_v"), Some((truth, truth)));
    }
}
