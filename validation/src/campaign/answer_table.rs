//! Tables of graded diagnoses: one row for each group, then one for each kind of record.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::answer::{Answer, CERTAIN, SURE};
use super::tables::percent;
use crate::markdown::table;

/// What the columns of [`page`] count.
pub fn legend() -> String {
    format!(
        "\
*Right*: the first finding is a true cause, every true cause is named, nothing untrue is; `consistent` without an effect. *Honest*:
not right, but `ambiguous`, `insufficient` or `unexplained` with the truth among findings, alternatives or suspects. *Explained,
wrong*: `explained` with an untrue finding. *Sure, wrong*: an untrue finding with a probability above {SURE}. *True at {CERTAIN}*: findings
of this probability or more that are true.
"
    )
}

/// All tables of the answers; the first column of the first one is headed `what`, those of the others `kinds`.
pub fn page(what: &str, kinds: &[&str], answers: &[Answer]) -> String {
    let mut text = named(what, answers, |answer| &answer.group);
    for (index, kind) in kinds.iter().enumerate() {
        write!(text, "\n{}", named(kind, answers, |answer| &answer.kinds[index])).expect("a string");
    }
    text
}

/// One row for each value of `key`, in the order of the answers, and one for all.
pub fn named(what: &str, answers: &[Answer], key: impl Fn(&Answer) -> &str) -> String {
    let mut groups: Vec<(&str, Vec<&Answer>)> = Vec::new();
    for answer in answers {
        match groups.iter_mut().find(|(group, _)| *group == key(answer)) {
            Some((_, inside)) => inside.push(answer),
            None => groups.push((key(answer), vec![answer])),
        }
    }
    groups.push(("**all**", answers.iter().collect()));
    let header = [
        what,
        "records",
        "first right",
        "nothing untrue",
        "right",
        "honest",
        "explained, wrong",
        "sure, wrong",
        "true at 0.99",
        "verdicts",
        "untrue names",
        "missing names",
    ];
    table(&header, groups.iter().map(|(group, answers)| row(group, answers)))
}

fn row(group: &str, answers: &[&Answer]) -> Vec<String> {
    let share = |is: &dyn Fn(&Answer) -> bool| {
        percent(answers.iter().filter(|answer| is(answer)).count() as f64 / answers.len().max(1) as f64)
    };
    let with_effect: Vec<_> = answers.iter().filter(|answer| !answer.null).collect();
    let first = with_effect.iter().filter(|answer| answer.first_is_right).count() as f64 / with_effect.len() as f64;
    let certain: Vec<_> =
        answers.iter().flat_map(|answer| &answer.found).filter(|named| named.probability >= CERTAIN).collect();
    let untrue = answers.iter().flat_map(|answer| &answer.found).filter(|named| !named.is_true);
    vec![
        group.to_owned(),
        answers.len().to_string(),
        if with_effect.is_empty() { "-".to_owned() } else { percent(first) },
        share(&Answer::nothing_untrue),
        share(&Answer::is_right),
        share(&Answer::is_honest),
        share(&Answer::explains_wrongly),
        share(&Answer::is_sure_and_wrong),
        format!("{} of {}", certain.iter().filter(|named| named.is_true).count(), certain.len()),
        tally(answers.iter().map(|answer| answer.verdict.as_str())),
        tally(untrue.map(|named| named.cause.as_str())),
        tally(answers.iter().flat_map(|answer| &answer.missing).copied()),
    ]
}

/// Names with their counts, the most frequent first.
fn tally<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    names.for_each(|name| *counts.entry(name).or_default() += 1);
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
    counts.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}

/// List of the records that are neither right nor honest, one line each with its seed.
pub fn wrong(answers: &[Answer]) -> String {
    let mut text = String::new();
    for answer in answers.iter().filter(|answer| !answer.is_right() && !answer.is_honest()) {
        let Answer { group, kinds, seed, verdict, found, missing, failure, .. } = answer;
        let found: Vec<_> = found.iter().map(|named| format!("{} {:.3}", named.cause, named.probability)).collect();
        let found = failure.clone().unwrap_or_else(|| found.join(", "));
        let missing = if missing.is_empty() { String::new() } else { format!(", missing {}", missing.join(", ")) };
        writeln!(text, "{group}, {}, seed {seed}: {verdict} [{found}]{missing}", kinds.join(", ")).expect("a string");
    }
    text
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::campaign::answer::tests::case;
    use crate::campaign::case::Expected;
    use crate::ground_truth::Cause;

    #[test]
    fn a_table_counts_right_honest_and_wrong_answers() {
        let case = case(Expected::exactly(&[Cause::Drift]));
        let subject = (case.draw)(1);
        let reports = [
            json!({"verdict": "explained", "findings": [{"cause": "drift", "probability": 1.0}]}),
            json!({"verdict": "explained", "findings": [{"cause": "hum", "probability": 0.95}]}),
            json!({"verdict": "ambiguous", "findings": [{"cause": "hum", "probability": 0.5}], "alternatives": [["drift"]]}),
            json!({"verdict": "consistent", "findings": []}),
        ];
        let answers: Vec<_> = reports.map(|report| Answer::of(&case, &subject, Ok(report))).into();
        let page = page("group", &["kind"], &answers);
        let row = "4 | 25 % | 50 % | 25 % | 25 % | 25 % | 25 % | 1 of 1 | explained 2, ambiguous 1, consistent 1 | hum 2 | drift 3 |";
        assert_eq!(page.matches(row).count(), 4, "{page}");
        assert_eq!(wrong(&answers).lines().count(), 2, "{}", wrong(&answers));
    }
}
