//! What each empirical threshold of the diagnosis decides: the same records at half and twice its value.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use anyhow::{Result, bail};
use cpu_time::ThreadTime;
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::detectable;
use super::diagnosis::{Diagnose, THRESHOLDS, Threshold};
use super::part::{pairs, seed};
use super::score::Report;
use crate::ground_truth::noise::{Kind, Noise};
use crate::ground_truth::out_of_model::form::Form;
use crate::ground_truth::record::Recipe;
use crate::ground_truth::{Cause, LabelledRecord, out_of_model};
use crate::markdown::table;

/// Size of a small effect, relative to the smallest that can be detected in its record.
const SMALL: f64 = 3.0;
/// Rows of the records in turn: full size, small, without an effect, and pairs.
const ROWS: [&[usize]; 4] = [&[601], &[301, 120, 301], &[601, 40, 301, 120], &[301, 601, 120]];

/// A record and the causes that are right answers.
pub struct Case {
    record: LabelledRecord,
    /// The law of a record of the out-of-model test set.
    form: Option<Form>,
}

impl Case {
    fn of(recipe: &Recipe, seed: u64) -> Self {
        Self { record: recipe.draw(seed), form: None }
    }

    fn has_effect(&self) -> bool {
        self.form.is_some() || !self.record.effects.is_empty()
    }

    /// True if a cause is right as the first finding.
    fn is_named(&self, name: &str) -> bool {
        self.form.map_or_else(|| self.is_true(name), |form| form.is_named(name))
    }

    /// True if a cause is in the record.
    fn is_true(&self, name: &str) -> bool {
        let hidden = || self.record.effects.iter().any(|effect| effect.cause.name() == name);
        self.form.map_or_else(hidden, |form| form.is_true(name))
    }
}

/// Returns `count` times 55 records: 19 single effects of full size and 19 small ones, 10 records without an effect, 5 with
/// pairs of effects, and 2 of the out-of-model test set; 40 to 2401 rows, all kinds of noise.
pub fn cases(first: u64, count: usize) -> Vec<Case> {
    let rows = |of: usize, index: usize| ROWS[of][index % ROWS[of].len()];
    let spread = |all: usize, wanted: usize| (0..wanted).map(move |index| index * all / wanted);
    let kind = |index: usize| Kind::ALL[index % Kind::ALL.len()];
    let mut recipes: Vec<(Recipe, bool)> = Vec::new();
    for small in [false, true] {
        for index in 0..count * Cause::ALL.len() {
            let recipe = Recipe::of(&[Cause::ALL[index % Cause::ALL.len()]]);
            let (rows, uneven) = (rows(usize::from(small), index), small && index % 4 == 3);
            recipes.push((Recipe { rows, uneven, ..recipe }, small));
        }
    }
    for index in 0..count * 10 {
        let recipe = Recipe { rows: rows(2, index / 4 + index), ..Recipe::of(&[]) };
        recipes.push((Recipe { noise: Noise::white(0.2).of(kind(index)), ..recipe }, false));
    }
    let all = pairs(first, 1);
    for (index, pair) in spread(all.len(), count * 5).enumerate() {
        let recipe = Recipe { rows: rows(3, index), ..all[pair % all.len()].recipe.clone() };
        recipes.push((Recipe { noise: recipe.noise.of(kind(index)), ..recipe }, false));
    }
    let of_recipe = |(index, (recipe, small)): (usize, &(Recipe, bool))| {
        let mut case = Case::of(recipe, seed(first, 12, index));
        if *small && let Some(size) = detectable::size(&case.record) {
            case.record = case.record.at((SMALL * size).min(1.0));
        }
        case
    };
    let mut cases: Vec<Case> = recipes.par_iter().enumerate().map(of_recipe).collect();
    let forms = out_of_model::all();
    cases.extend(spread(forms.len(), count * 2).enumerate().map(|(index, form)| {
        let form = forms[form];
        Case { record: form.draw(seed(first, 13, index)), form: Some(form) }
    }));
    cases
}

/// Verdict and named causes of one record.
#[derive(Clone, Debug, PartialEq)]
struct Answer {
    verdict: String,
    found: Vec<String>,
}

/// Counts over the records at one value of a threshold.
#[derive(Clone, Debug, Serialize)]
pub struct Counts {
    /// Records with an effect whose first finding is right.
    pub first_right: usize,
    /// Records with an effect and a finding that is false.
    pub extra: usize,
    /// Records without an effect that have a finding.
    pub false_alarms: usize,
    /// Records whose verdict or findings differ from those at the value that is set.
    pub changed: usize,
    /// CPU time of all diagnoses, relative to that at the value that is set.
    pub cpu_ratio: f64,
}

/// Counts at half and twice the value of one threshold.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the threshold.
    pub name: &'static str,
    /// Counts at half of its value.
    pub half: Counts,
    /// Counts at twice its value.
    pub twice: Counts,
    #[serde(skip)]
    threshold: Threshold,
}

/// In place of the verdict of a diagnosis that failed.
const REJECTED: &str = "rejected";

/// Number of diagnoses of [`run`].
pub fn diagnoses(cases: &[Case]) -> usize {
    (1 + 2 * THRESHOLDS.len()) * cases.len()
}

/// Diagnoses the records as they are, then at half and twice the value of every threshold, which `vary` multiplies by a factor.
/// Returns the counts as they are, and those of each threshold.
///
/// # Errors
/// A diagnosis fails with all thresholds as they are set, or a report has another form than documented.
pub fn run(
    cases: &[Case],
    vary: fn(Option<(Threshold, f64)>),
    diagnose: &Diagnose<'_>,
    progress: &ProgressBar,
) -> Result<(Counts, Vec<Row>)> {
    let (as_set, time) = answers(cases, diagnose, progress)?;
    if let Some(case) = as_set.iter().position(|answer| answer.verdict == REJECTED) {
        bail!("record {case} of {}: its diagnosis fails with all thresholds as they are set", cases.len());
    }
    let at = |threshold: Threshold, factor: f64| {
        vary(Some((threshold, factor)));
        let result = answers(cases, diagnose, progress);
        vary(None);
        result.map(|(answers, varied)| counts(cases, &as_set, &answers, varied.as_secs_f64() / time.as_secs_f64()))
    };
    let row = |&threshold: &Threshold| -> Result<Row> {
        Ok(Row { name: threshold.name, half: at(threshold, 0.5)?, twice: at(threshold, 2.0)?, threshold })
    };
    Ok((counts(cases, &as_set, &as_set, 1.0), THRESHOLDS.iter().map(row).collect::<Result<_>>()?))
}

/// Diagnoses the records on all cores; returns the answers and the CPU time.
fn answers(cases: &[Case], diagnose: &Diagnose<'_>, progress: &ProgressBar) -> Result<(Vec<Answer>, Duration)> {
    let one = |case: &Case| -> Result<(Answer, Duration)> {
        let start = ThreadTime::now();
        // At another value a diagnosis may meet a state that cannot occur at the value that is set.
        let report = catch_unwind(AssertUnwindSafe(|| diagnose(&case.record)));
        let time = start.elapsed();
        progress.inc(1);
        let Ok(Ok(report)) = report else {
            return Ok((Answer { verdict: REJECTED.to_owned(), found: Vec::new() }, time));
        };
        let Report { verdict, findings, .. } = serde_json::from_value(report)?;
        Ok((Answer { verdict, found: findings.into_iter().map(|finding| finding.cause).collect() }, time))
    };
    let (answers, times): (Vec<_>, Vec<_>) = cases.par_iter().map(one).collect::<Result<Vec<_>>>()?.into_iter().unzip();
    Ok((answers, times.iter().sum()))
}

fn counts(cases: &[Case], as_set: &[Answer], answers: &[Answer], cpu_ratio: f64) -> Counts {
    let count = |is: &dyn Fn(&Case, &Answer) -> bool| {
        cases.iter().zip(answers).filter(|(case, answer)| is(case, answer)).count()
    };
    Counts {
        first_right: count(&|case, answer| answer.found.first().is_some_and(|name| case.is_named(name))),
        extra: count(&|case, answer| case.has_effect() && answer.found.iter().any(|name| !case.is_true(name))),
        false_alarms: count(&|case, answer| !case.has_effect() && !answer.found.is_empty()),
        changed: as_set.iter().zip(answers).filter(|(before, after)| before != after).count(),
        cpu_ratio,
    }
}

/// Page with the counts of each threshold, and with its decision and the command that set it.
pub fn page(cases: &[Case], as_set: &Counts, rows: &[Row]) -> String {
    let effects = cases.iter().filter(|case| case.has_effect()).count();
    let cells = |counts: &Counts| {
        let Counts { first_right, extra, false_alarms, changed, cpu_ratio } = counts;
        let mut cells = [first_right, extra, false_alarms, changed].map(usize::to_string).to_vec();
        cells.push(format!("{cpu_ratio:.2}"));
        cells
    };
    let note = |row: &Row| match (row.half.changed, row.twice.changed) {
        (0, 0) => "no difference in these records",
        (0, _) => "no difference at half",
        (_, 0) => "no difference at twice",
        _ => "",
    };
    let counted = rows.iter().map(|row| {
        let start = [format!("`{}`", row.name), row.threshold.value.to_string()];
        start.into_iter().chain(cells(&row.half)).chain(cells(&row.twice)).chain([note(row).to_owned()]).collect()
    });
    let set_by = |threshold: &Threshold| match threshold.set_by {
        "" => "kept from the first campaign; this table".to_owned(),
        command => format!("`{command}`"),
    };
    let described = rows.iter().map(|Row { threshold, .. }| {
        let value = format!("{} {}", threshold.value, threshold.unit);
        vec![format!("`{}`", threshold.name), value, threshold.decision.trim().to_owned(), set_by(threshold)]
    });
    let header = [
        "threshold",
        "value",
        "half: first right",
        "extra",
        "false alarms",
        "changed",
        "CPU time",
        "twice: first right",
        "extra",
        "false alarms",
        "changed",
        "CPU time",
        "note",
    ];
    format!(
        "\
The empirical thresholds of the diagnosis, each at half and at twice its value while all others keep theirs. {} records:
{effects} with effects (single effects of full size, single effects of {SMALL} times the detectable size, pairs, laws of the
out-of-model test set) and {} without; 40 to 2401 rows, all kinds of noise.

*First right*: the first finding is a true cause. *Extra*: records with an effect and a false finding. *False alarms*: records
without an effect that have a finding. *Changed*: records whose verdict or findings differ from those at the value that is set.
*CPU time*: relative to that at the value that is set. A threshold that changes no record at half and twice its value decides
nothing in these records; it may in others.

As set: {} first right, {} extra, {} false alarms.

{}
Which decision each threshold takes, and the command whose counts set it:

{}",
        cases.len(),
        cases.len() - effects,
        as_set.first_right,
        as_set.extra,
        as_set.false_alarms,
        table(&header, counted),
        table(&["threshold", "value", "decision", "set by"], described),
    )
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use serde_json::json;

    use super::*;

    static FIRST_IS_VARIED: AtomicBool = AtomicBool::new(false);

    #[test]
    fn only_the_threshold_that_changes_a_record_is_counted_as_deciding() {
        let of = |causes: &[Cause]| Case::of(&Recipe { rows: 40, ..Recipe::of(causes) }, 1);
        let cases = [of(&[Cause::Drift]), of(&[])];
        let vary = |varied: Option<(Threshold, f64)>| {
            let first = varied.is_some_and(|(threshold, factor)| threshold.name == THRESHOLDS[0].name && factor > 1.0);
            FIRST_IS_VARIED.store(first, Ordering::Relaxed);
        };
        let diagnose = |_: &LabelledRecord| {
            let cause = if FIRST_IS_VARIED.load(Ordering::Relaxed) { "hum" } else { "drift" };
            Ok(json!({"verdict": "explained", "findings": [{"cause": cause}]}))
        };
        let (as_set, rows) = run(&cases, vary, &diagnose, &ProgressBar::hidden()).unwrap();
        assert_eq!((as_set.first_right, as_set.extra, as_set.false_alarms), (1, 0, 1));
        let twice = &rows[0].twice;
        assert_eq!((twice.first_right, twice.extra, twice.false_alarms, twice.changed), (0, 1, 1, 2));
        assert!(rows[0].half.changed == 0 && rows[1..].iter().all(|row| row.half.changed + row.twice.changed == 0));
        let page = page(&cases, &as_set, &rows);
        let lines = |note: &str| page.lines().filter(|line| line.ends_with(&format!("| {note} |"))).count();
        assert_eq!((lines("no difference at half"), lines("no difference in these records")), (1, rows.len() - 1));
    }

    #[test]
    fn the_records_cover_all_causes_and_lengths() {
        let cases = cases(1, 1);
        let effects = cases.iter().filter(|case| case.has_effect()).count();
        assert_eq!((cases.len(), effects), (55, 45));
        assert!(Cause::ALL.iter().all(|cause| cases.iter().any(|case| case.is_true(cause.name()))));
    }
}
