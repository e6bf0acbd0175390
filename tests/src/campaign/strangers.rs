//! What the diagnosis makes of records whose laws it was not made with, judged by the names that each form accepts.
//!
//! The first finding decides. A name that the form does not accept there is wrong; no finding is a miss, which `unexplained` says
//! openly. `unexplained` beside a right first name is right too: such a law lies outside the catalogue.

use std::collections::BTreeMap;
use std::fmt::Write;

use anyhow::{Result, bail};
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::part::seed;
use super::score::Report;
use super::seam::Diagnose;
use super::tables::table;
use crate::hidden::strangers::Form;
use crate::hidden::{Cause, Noise};

/// What was said of a record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// Of the form.
    pub form: &'static str,
    /// Of the record.
    pub seed: u64,
    /// As it was given.
    pub verdict: String,
    /// The causes that were found, in order.
    pub found: Vec<String>,
    /// The verdict is `ambiguous`, and one of the alternatives is true.
    pub true_among_alternatives: bool,
    /// What that is worth.
    pub grade: Grade,
}

/// What an answer is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grade {
    /// First name right, all others true as well.
    Right,
    /// First name right, and one that is not true.
    More,
    /// No name.
    Silent,
    /// Another first name than a right one.
    Wrong,
}

impl Grade {
    fn of(form: &Form, found: &[String]) -> Self {
        match found {
            [] => Self::Silent,
            [first, ..] if !form.is_named(first) => Self::Wrong,
            found if found.iter().all(|name| form.is_true(name)) => Self::Right,
            _ => Self::More,
        }
    }
}

/// `count` records of each form, with their seeds.
pub fn jobs(forms: &[Form], first: u64, count: usize) -> Vec<(Form, u64)> {
    let forms = forms.iter().flat_map(|form| std::iter::repeat_n(*form, count));
    forms.enumerate().map(|(index, form)| (form, seed(first, 10, index))).collect()
}

/// Their diagnoses, on all cores, in the order of the jobs.
///
/// # Errors
/// A record is refused, or the report is none.
pub fn run(jobs: &[(Form, u64)], diagnose: &Diagnose<'_>, progress: &ProgressBar) -> Result<Vec<Answer>> {
    let one = |&(ref form, seed): &(Form, u64)| -> Result<Answer> {
        let Report { verdict, findings, alternatives, .. } = serde_json::from_value(diagnose(&form.draw(seed))?)?;
        let found: Vec<String> = findings.into_iter().map(|finding| finding.cause).collect();
        progress.inc(1);
        if let Some(name) = found.iter().find(|name| Cause::named(name).is_none()) {
            bail!("{}, seed {seed}: {name} is no cause", form.name);
        }
        let is_true =
            |set: &Vec<String>| set.iter().any(|name| form.is_named(name)) && set.iter().all(|name| form.is_true(name));
        let true_among_alternatives = verdict == "ambiguous" && alternatives.iter().any(is_true);
        let grade = Grade::of(form, &found);
        Ok(Answer { form: form.name, seed, verdict, found, true_among_alternatives, grade })
    };
    jobs.par_iter().map(one).collect()
}

/// The table of the answers, then what each form is.
pub fn page(forms: &[Form], answers: &[Answer]) -> String {
    let mut text = format!(
        "\
One effect in each record, by a law that `vsj diagnose` was not made with; plain sizes, {} V of white noise. The names that are
right for a form were written down before the first diagnosis: in brackets those that are as right in the first place, after
\"and\" those that are true beside it. *right*: first finding right and all others true. *more*: first right, beside it a name
that is not true. *silent*: no finding. *wrong*: the first finding is another name, be it one that is true beside a right one.
`unexplained` beside a right first name counts as right.

At the first printing 107 of 245 were right, 69 said more, 7 were silent, 62 wrong. What it showed has led to three rules (a
resonance is damped by half at most, spikes in time with the command are no outliers, a second cause in the same stage of
the chain has to be worth more), to two forms of amplifier-slew (two rates, output resistance) and to two of
second-relaxation (by decades, spread). So the laws are no longer unseen, and those two amplifiers are no strangers.

",
        Noise::white(0.2).sigma_v
    );
    let mut rows: Vec<Vec<String>> = forms.iter().map(|form| row(form, answers)).collect();
    let all: Vec<&Answer> = answers.iter().collect();
    let mut last = vec!["**all**".to_owned(), String::new()];
    last.extend(counts(&all));
    last.extend([verdicts(&all), String::new(), String::new()]);
    rows.push(last);
    let header =
        ["hidden", "form", "records", "right", "more", "silent", "wrong", "verdicts", "not true, times said", "judged"];
    text += &table(&header, rows);
    text += &order(forms, answers);
    let laws = forms.iter().map(|form| [form.name, form.law, form.source].map(str::to_owned).to_vec());
    write!(text, "\nx is the voltage over 500 V.\n\n{}", table(&["form", "law", "source"], laws)).expect("a string");
    text
}

/// How wrong the wrong ones are.
fn order(forms: &[Form], answers: &[Answer]) -> String {
    let form = |answer: &Answer| forms.iter().find(|form| form.name == answer.form).expect("an answer has a form");
    let wrong: Vec<&Answer> = answers.iter().filter(|answer| answer.grade == Grade::Wrong).collect();
    let count = |which: &dyn Fn(&Answer) -> bool| wrong.iter().filter(|answer| which(answer)).count();
    let behind = |answer: &Answer| answer.found.iter().any(|name| form(answer).is_named(name));
    let all_true = |answer: &Answer| answer.found.iter().all(|name| form(answer).is_true(name));
    format!(
        "\nOf the {} wrong ones, {} have a right name further back, {} of these with nothing untrue beside it;\n\
         {} are `ambiguous` with the truth among the alternatives.\n",
        wrong.len(),
        count(&behind),
        count(&|answer| behind(answer) && all_true(answer)),
        count(&|answer| answer.true_among_alternatives)
    )
}

fn row(form: &Form, answers: &[Answer]) -> Vec<String> {
    let of: Vec<&Answer> = answers.iter().filter(|answer| answer.form == form.name).collect();
    let names = |causes: &[Cause]| causes.iter().map(|cause| cause.name()).collect::<Vec<_>>().join(", ");
    let mut hidden = form.cause.name().to_owned();
    if !form.or.is_empty() {
        hidden += &format!(" [{}]", names(form.or));
    }
    if !form.beside.is_empty() {
        hidden += &format!(" and {}", names(form.beside));
    }
    let untrue = of.iter().flat_map(|answer| &answer.found).map(String::as_str).filter(|name| !form.is_true(name));
    let mut cells = vec![hidden, form.name.to_owned()];
    cells.extend(counts(&of));
    cells.extend([verdicts(&of), tally(untrue), judged(&of).to_owned()]);
    cells
}

fn count(answers: &[&Answer], grade: Grade) -> usize {
    answers.iter().filter(|answer| answer.grade == grade).count()
}

/// Records, then grades.
fn counts(answers: &[&Answer]) -> Vec<String> {
    let grades = [Grade::Right, Grade::More, Grade::Silent, Grade::Wrong].map(|grade| count(answers, grade));
    std::iter::once(answers.len()).chain(grades).map(|number| number.to_string()).collect()
}

fn verdicts(answers: &[&Answer]) -> String {
    tally(answers.iter().map(|answer| answer.verdict.as_str()))
}

/// Of a form: the worst that happened in it.
fn judged(answers: &[&Answer]) -> &'static str {
    let worst = [Grade::Wrong, Grade::Silent, Grade::More].into_iter().find(|&grade| count(answers, grade) > 0);
    match worst {
        Some(Grade::Wrong) => "wrong name",
        Some(Grade::Silent) => "misses",
        Some(_) => "says more",
        None => "right",
    }
}

/// Names and how often, in alphabetical order.
fn tally<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    names.for_each(|name| *counts.entry(name).or_default() += 1);
    counts.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}

/// Records that were not right, for whoever wants to look at one.
pub fn wrong(forms: &[Form], answers: &[Answer]) -> String {
    let mut text = String::new();
    for answer in answers.iter().filter(|answer| answer.grade != Grade::Right) {
        let cause = forms.iter().find(|form| form.name == answer.form).map_or("", |form| form.cause.name());
        let Answer { form, seed, verdict, found, grade, .. } = answer;
        writeln!(text, "{cause}, {form}, seed {seed}: {grade:?}, {verdict} [{}]", found.join(", ")).expect("a string");
    }
    text
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::hidden::strangers::all;

    #[test]
    fn the_first_name_decides() {
        let forms = all();
        let form = forms.iter().find(|form| form.name == "soft limit").unwrap();
        let grade = |names: &[&str]| Grade::of(form, &names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>());
        assert_eq!(grade(&[]), Grade::Silent);
        assert_eq!(grade(&["amplifier-limit"]), Grade::Right);
        assert_eq!(grade(&["static-nonlinearity", "amplifier-limit"]), Grade::Right, "either is right");
        assert_eq!(grade(&["amplifier-limit", "drift"]), Grade::More);
        assert_eq!(grade(&["drift", "amplifier-limit"]), Grade::Wrong);
        let sagging = forms.iter().find(|form| form.name == "sagging supply").unwrap();
        let leakage = ["charge-leakage".to_owned(), "amplifier-limit".to_owned()];
        assert_eq!(Grade::of(sagging, &leakage), Grade::Wrong, "true beside the limit, not in its place");
    }

    #[test]
    fn a_page_counts_what_was_said() {
        let forms = &all()[..1];
        let says = |report: serde_json::Value| {
            run(&jobs(forms, 1, 2), &|_| Ok(report.clone()), &ProgressBar::hidden())
                .map(|answers| page(forms, &answers))
        };
        let wrong = says(json!({"verdict": "explained", "findings": [{"cause": "hum"}]})).unwrap();
        assert!(wrong.contains("| 2 | 0 | 0 | 0 | 2 | explained 2 | hum 2 | wrong name |"), "{wrong}");
        assert!(wrong.contains("Of the 2 wrong ones, 0 have a right name further back"), "{wrong}");
        let right = says(json!({"verdict": "unexplained", "findings": [{"cause": forms[0].cause.name()}]})).unwrap();
        assert!(right.contains("| 2 | 2 | 0 | 0 | 0 | unexplained 2 |  | right |"), "{right}");
        assert!(says(json!({"verdict": "explained", "findings": [{"cause": "gremlins"}]})).is_err());
    }
}
