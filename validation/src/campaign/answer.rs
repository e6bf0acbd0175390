//! Diagnoses graded by the names that are true of a record: what is named first, with what probability, and what else.
//!
//! In: a [`Case`], which draws a record and knows its true causes, and the JSON of a diagnosis. Out: an [`Answer`].

use anyhow::{Context, Result};
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;

use super::case::Case;
use super::score::{Estimate, Report, estimates};
use super::subject::{Nominal, Subject};

/// A probability above which a wrong name counts as confidently wrong.
pub const SURE: f64 = 0.9;
/// A probability from which a finding is called certain.
pub const CERTAIN: f64 = 0.99;

/// A finding, and whether it is true.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Named {
    /// Cause code.
    pub cause: String,
    /// Stated probability.
    pub probability: f64,
    /// True if the code is true of the record.
    pub is_true: bool,
}

/// Graded diagnosis of one record.
#[derive(Clone, Debug, Serialize)]
pub struct Answer {
    /// Row of the first table.
    pub group: String,
    /// Rows of the further tables.
    pub kinds: Vec<String>,
    /// Seed of the record.
    pub seed: u64,
    /// Verdict of the report; `failed` if there was no report.
    pub verdict: String,
    /// Findings in their order.
    pub found: Vec<Named>,
    /// Codes that are correct as the first finding and are not among the findings, if all of them must be named or none is.
    pub missing: Vec<&'static str>,
    /// True if the first finding is correct.
    pub first_is_right: bool,
    /// True if what must be named is among findings, alternatives or suspects.
    pub truth_is_mentioned: bool,
    /// True if the record has no effect.
    pub null: bool,
    /// True if `consistent` without a finding is correct.
    pub or_none: bool,
    /// Parameters of the correct findings, if the record is in the simulator's units.
    pub parameters: Vec<Estimate>,
    /// Error message if there was no report.
    pub failure: Option<String>,
}

impl Answer {
    /// Grades the JSON of a diagnosis.
    pub fn of(case: &Case, subject: &Subject, report: Result<Value>) -> Self {
        let report = report.and_then(|json| serde_json::from_value::<Report>(json).context("expected a report"));
        let Case { group, kinds, seed, expected, .. } = case;
        let mut answer = Self {
            group: group.clone(),
            kinds: kinds.clone(),
            seed: *seed,
            verdict: "failed".to_owned(),
            found: Vec::new(),
            missing: expected.first.clone(),
            first_is_right: false,
            truth_is_mentioned: false,
            null: expected.first.is_empty(),
            or_none: expected.or_none || expected.first.is_empty(),
            parameters: Vec::new(),
            failure: None,
        };
        let report = match report {
            Ok(report) => report,
            Err(error) => {
                answer.failure = Some(format!("{error:#}"));
                return answer;
            }
        };
        let is_found = |code: &str| report.findings.iter().any(|finding| finding.cause == code);
        let is_rival = |code: &str| report.alternatives.iter().flatten().any(|name| name == code);
        let is_suspect = |code: &str| report.suspects.iter().any(|suspect| suspect.cause == code);
        answer.missing.retain(|code| !is_found(code) && (expected.all || !expected.is_named(is_found)));
        answer.first_is_right =
            report.findings.first().is_some_and(|finding| expected.first.contains(&finding.cause.as_str()));
        answer.truth_is_mentioned = expected.is_named(|code| is_found(code) || is_rival(code) || is_suspect(code));
        if subject.nominal == Nominal::Paper {
            answer.parameters =
                report.findings.iter().flat_map(|finding| estimates(&subject.hidden, finding)).collect();
        }
        let named = |finding: super::score::Finding| Named {
            is_true: expected.is_true(&finding.cause),
            probability: finding.probability,
            cause: finding.cause,
        };
        answer.found = report.findings.into_iter().map(named).collect();
        answer.verdict = report.verdict;
        answer
    }

    /// True if no finding is untrue.
    pub fn nothing_untrue(&self) -> bool {
        self.failure.is_none() && self.found.iter().all(|named| named.is_true)
    }

    /// True if the findings are correct: the first one right, nothing missing, nothing untrue. Without an effect: `consistent`, or
    /// only what is true in addition.
    pub fn is_right(&self) -> bool {
        let none = self.or_none && self.verdict == "consistent" && self.found.is_empty();
        let named = if self.null { !self.found.is_empty() } else { self.first_is_right && self.missing.is_empty() };
        none || named && self.nothing_untrue()
    }

    /// True if the answer is not right but leaves room for the truth: `ambiguous`, `insufficient` or `unexplained`, with the truth
    /// among findings, alternatives or suspects, or `insufficient` without a finding. Without an effect: no finding.
    pub fn is_honest(&self) -> bool {
        let open = ["ambiguous", "insufficient", "unexplained"].contains(&self.verdict.as_str());
        let fair = if self.null {
            self.found.is_empty()
        } else {
            self.truth_is_mentioned || self.verdict == "insufficient" && self.found.is_empty()
        };
        !self.is_right() && open && fair
    }

    /// True if the verdict is `explained` and a finding is untrue.
    pub fn explains_wrongly(&self) -> bool {
        self.verdict == "explained" && !self.nothing_untrue()
    }

    /// True if an untrue finding has a probability above [`SURE`].
    pub fn is_sure_and_wrong(&self) -> bool {
        self.found.iter().any(|named| !named.is_true && named.probability > SURE)
    }
}

/// Draws and diagnoses the records on all cores; the answers are in the order of the cases.
pub fn run(
    cases: &[Case],
    diagnose: &(dyn Fn(&Subject) -> Result<Value> + Sync),
    progress: &ProgressBar,
) -> Vec<Answer> {
    let one = |case: &Case| {
        let subject = (case.draw)(case.seed);
        let answer = Answer::of(case, &subject, diagnose(&subject));
        progress.inc(1);
        answer
    };
    cases.par_iter().map(one).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use serde_json::json;

    use super::*;
    use crate::campaign::case::Expected;
    use crate::ground_truth::Cause;
    use crate::ground_truth::record::Recipe;

    /// A case of the causes, whose answers are graded without a diagnosis.
    pub(in crate::campaign) fn case(expected: Expected) -> Case {
        let draw = Box::new(|seed| Recipe { rows: 20, ..Recipe::of(&[]) }.draw(seed).into());
        Case { group: "a".into(), kinds: vec!["b".into()], seed: 1, expected, draw }
    }

    fn graded(expected: Expected, report: Value) -> Answer {
        let case = case(expected);
        Answer::of(&case, &(case.draw)(1), Ok(report))
    }

    fn report(verdict: &str, findings: &[(&str, f64)], alternatives: &[&str]) -> Value {
        let findings: Vec<_> =
            findings.iter().map(|(cause, probability)| json!({"cause": cause, "probability": probability})).collect();
        json!({"verdict": verdict, "findings": findings, "alternatives": [alternatives], "suspects": []})
    }

    #[test]
    fn both_causes_of_a_pair_must_be_named_and_nothing_else() {
        let pair = || Expected::exactly(&[Cause::GainError, Cause::Hysteresis]);
        let right = graded(pair(), report("explained", &[("hysteresis", 1.0), ("gain-error", 0.99)], &[]));
        assert!(right.is_right() && !right.is_honest() && right.missing.is_empty() && !right.is_sure_and_wrong());
        let half = graded(pair(), report("explained", &[("hysteresis", 1.0)], &[]));
        assert!(!half.is_right() && half.first_is_right && half.nothing_untrue() && half.missing == ["gain-error"]);
        let open = graded(pair(), report("ambiguous", &[("hysteresis", 1.0)], &["gain-error"]));
        assert!(open.is_honest() && !open.is_right());
        let wrong =
            graded(pair(), report("explained", &[("hysteresis", 1.0), ("gain-error", 1.0), ("hum", 0.95)], &[]));
        assert!(wrong.explains_wrongly() && wrong.is_sure_and_wrong() && !wrong.is_right() && wrong.missing.is_empty());
        let unsure = graded(pair(), report("unexplained", &[("hum", 0.6)], &[]));
        assert!(!unsure.explains_wrongly() && !unsure.is_sure_and_wrong() && !unsure.is_honest());
    }

    #[test]
    fn one_of_several_first_names_is_enough() {
        let law =
            || Expected { first: vec!["delay", "series-lag"], also: vec!["time-constant"], all: false, or_none: false };
        let right = graded(law(), report("explained", &[("series-lag", 1.0), ("time-constant", 0.8)], &[]));
        assert!(right.is_right() && right.missing.is_empty());
        let second = graded(law(), report("explained", &[("time-constant", 1.0)], &[]));
        assert!(!second.is_right() && second.nothing_untrue() && second.missing == ["delay", "series-lag"]);
    }

    #[test]
    fn a_record_without_an_effect_is_right_if_it_is_called_consistent() {
        assert!(graded(Expected::default(), report("consistent", &[], &[])).is_right());
        let insufficient = graded(Expected::default(), report("insufficient", &[], &[]));
        assert!(!insufficient.is_right() && insufficient.is_honest());
        let found = graded(Expected::default(), report("unexplained", &[("hum", 0.5)], &[]));
        assert!(!found.is_right() && !found.is_honest());
        let rounded = Expected { also: vec!["quantisation"], or_none: true, ..Expected::default() };
        assert!(graded(rounded, report("explained", &[("quantisation", 1.0)], &[])).is_right());
    }

    #[test]
    fn suspects_of_an_unexplained_record_count_as_mentioned() {
        let report =
            json!({"verdict": "unexplained", "findings": [], "suspects": [{"cause": "drift", "rmse_before": 2.0}]});
        assert!(graded(Expected::exactly(&[Cause::Drift]), report.clone()).is_honest());
        assert!(!graded(Expected::exactly(&[Cause::Hum]), report).is_honest());
        let failed = case(Expected::exactly(&[Cause::Hum]));
        let failed = Answer::of(&failed, &(failed.draw)(1), Err(anyhow::anyhow!("no")));
        assert!(!failed.is_right() && !failed.is_honest() && failed.verdict == "failed");
    }
}
