//! The diagnosis of one record compared with its true causes and values.

use std::collections::BTreeMap;

use cpu_time::ThreadTime;
use serde::{Deserialize, Serialize};

use super::cramer_rao;
use super::diagnosis::Diagnose;
use crate::ground_truth::{Cause, LabelledRecord};

/// The fields of a report that are scored.
#[derive(Debug, Deserialize)]
pub(super) struct Report {
    pub(super) verdict: String,
    pub(super) findings: Vec<Finding>,
    #[serde(default)]
    pub(super) alternatives: Vec<Vec<String>>,
    #[serde(default)]
    pub(super) suspects: Vec<Suspect>,
    extended: Option<Extended>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Suspect {
    pub(super) cause: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct Finding {
    pub(super) cause: String,
    #[serde(default)]
    pub(super) probability: f64,
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

/// True and named causes of one record.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// Seed of the record.
    pub seed: u64,
    /// True causes.
    pub hidden: Vec<&'static str>,
    /// Verdict; `failed` if there was no report.
    pub verdict: String,
    /// Named causes, in the order of the findings.
    pub found: Vec<String>,
    /// True if the verdict is `ambiguous` and one alternative is the set of true causes.
    pub truth_among_alternatives: bool,
    /// Parameters of every correct finding.
    pub parameters: Vec<Estimate>,
    /// Held-out error of the extended model, relative to the error of the true spring.
    pub held_out_ratio: Option<f64>,
    /// CPU time of the diagnosis, in s.
    pub seconds: f64,
    /// Error message if there was no report.
    pub failure: Option<String>,
}

/// A parameter of a finding compared with its true value.
#[derive(Clone, Debug, Serialize)]
pub struct Estimate {
    /// Cause that the parameter belongs to.
    pub cause: Cause,
    /// Name of the parameter.
    pub name: String,
    /// True value.
    pub truth: f64,
    /// Estimated value; `None` if the finding lacks it.
    pub value: Option<f64>,
    /// Absolute relative error; infinite if the finding lacks the value.
    pub error: f64,
    /// True if the 95 % interval of the finding contains the true value.
    pub covered: bool,
    /// Cramer-Rao bound of the median error in this record, where there is one.
    pub at_best: Option<f64>,
}

impl Outcome {
    /// Diagnoses a record and scores the report.
    pub fn of(hidden: &LabelledRecord, diagnose: &Diagnose<'_>) -> Self {
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

    /// True if the first finding is one of the true causes.
    pub fn first_is_right(&self) -> bool {
        self.found.first().is_some_and(|first| self.hidden.contains(&first.as_str()))
    }

    /// True if every true cause is named.
    pub fn all_named(&self) -> bool {
        self.failure.is_none() && self.hidden.iter().all(|name| self.found.iter().any(|found| found == name))
    }

    /// True if the verdict is correct: `consistent` without an effect, `explained` or `ambiguous` with one.
    pub fn verdict_is_right(&self) -> bool {
        let right: &[&str] = if self.hidden.is_empty() { &["consistent"] } else { &["explained", "ambiguous"] };
        right.contains(&self.verdict.as_str())
    }

    /// True if no other cause than the true ones is named.
    pub fn nothing_extra(&self) -> bool {
        self.failure.is_none() && self.found.iter().all(|found| self.hidden.contains(&found.as_str()))
    }
}

/// Every parameter of a finding whose cause is correct, including the documented ones that the finding lacks.
pub(super) fn estimates(hidden: &LabelledRecord, finding: &Finding) -> Vec<Estimate> {
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
            let at_best = cramer_rao::median_error(hidden, cause, name);
            Some(Estimate { cause, name: name.to_owned(), truth, value, error, covered, at_best })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::ground_truth::record::Recipe;

    fn report(cause: &str, parameters: serde_json::Value) -> serde_json::Value {
        json!({"verdict": "explained", "findings": [{"cause": cause, "parameters": parameters}],
            "alternatives": [], "extended": {"held_out_rmse": 1.0}})
    }

    #[test]
    fn correct_findings_score_and_false_or_missing_ones_do_not() {
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
        assert!(outcome.parameters[0].error.is_infinite(), "a missing parameter has an infinite error");
        let outcome = Outcome::of(&hidden, &|_| anyhow::bail!("no"));
        assert!(!outcome.all_named() && !outcome.nothing_extra() && !outcome.verdict_is_right());
        let null = Recipe::of(&[]).draw(1);
        let unsure = Outcome::of(&null, &|_| Ok(json!({"verdict": "unexplained", "findings": []})));
        assert!(unsure.nothing_extra() && !unsure.verdict_is_right());
    }

    #[test]
    fn a_static_nonlinearity_is_scored_at_the_voltage_in_the_parameters_name() {
        let hidden = Recipe::of(&[Cause::StaticNonlinearity]).draw(1);
        let at = hidden.effects[0].law().unwrap().at(250.0);
        let curve = json!({"at_250_v": {"value": at, "low": at - 1.0, "high": at + 1.0}});
        let outcome = Outcome::of(&hidden, &|_| Ok(report("static-nonlinearity", curve.clone())));
        assert!(outcome.parameters[0].error < 1e-9 && outcome.parameters[0].covered);
        let truth = hidden.effects[0].law().unwrap().at(99.8);
        assert_eq!(hidden.true_value(Cause::StaticNonlinearity, "at_99.8_v"), Some((truth, truth)));
    }
}
