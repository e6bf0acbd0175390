//! Results of the campaign as Markdown.

use std::fmt::Write;

use super::part::Job;
use super::score::Outcome;
use super::sensitivity::{SIZES, Sensitivity};
use super::summary::{Accuracy, Summary};
use crate::ground_truth::Cause;
use crate::markdown::table;

pub(super) fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    if percent.fract().abs() < 1e-9 { format!("{percent:.0} %") } else { format!("{percent:.1} %") }
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"))
}

/// Named causes, false findings, verdicts and held-out error: one row for each group and one for all.
pub fn named(what: &str, jobs: &[Job], outcomes: &[Outcome]) -> String {
    let mut summaries = Summary::by_group(jobs, outcomes);
    summaries.push(Summary::of("**all**", &outcomes.iter().collect::<Vec<_>>()));
    let row = |s: &Summary| {
        let verdicts: Vec<_> = s.verdicts.iter().map(|(verdict, count)| format!("{verdict} {count}")).collect();
        let none = jobs.iter().any(|job| job.group == s.group && job.recipe.causes.is_empty());
        let hidden = |part: f64| if none { "-".to_owned() } else { percent(part) };
        vec![
            s.group.clone(),
            s.records.to_string(),
            hidden(s.first),
            hidden(s.all_named),
            percent(s.nothing_extra),
            percent(s.verdict_right),
            verdicts.join(", "),
            number(s.held_out_ratio),
            number(s.held_out_ratio_95),
            number(s.seconds),
        ]
    };
    table(
        &[
            what,
            "records",
            "first correct",
            "all named",
            "no false finding",
            "verdict correct",
            "verdicts",
            "held-out error / floor",
            "95 % quantile",
            "CPU time [s]",
        ],
        summaries.iter().map(row),
    )
}

/// CPU time of a diagnosis and what it finds: one row for each noise and length, the shortest records first.
pub fn speed(jobs: &[Job], outcomes: &[Outcome]) -> String {
    let mut before: Option<(&str, f64, f64)> = None;
    let row = |chunk: &[(&Job, &Outcome)]| {
        let (job, _) = chunk[0];
        let count = chunk.len() as f64;
        let share = |is: fn(&Outcome) -> bool| percent(chunk.iter().filter(|(_, it)| is(it)).count() as f64 / count);
        let mean = chunk.iter().map(|(_, outcome)| outcome.seconds).sum::<f64>() / count;
        let (_, worst) = chunk.iter().max_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds)).expect("no group is empty");
        let (noise, rows) = (job.recipe.noise.kind.name(), job.recipe.rows as f64);
        let shorter = before.filter(|(of, ..)| *of == noise);
        let power = shorter.map(|(_, fewer, less)| (mean / less).ln() / (rows / fewer).ln());
        before = Some((noise, rows, mean));
        vec![
            noise.to_owned(),
            job.recipe.rows.to_string(),
            chunk.len().to_string(),
            format!("{mean:.2}"),
            format!("{:.2}", worst.seconds),
            worst.hidden.join(", "),
            power.map_or_else(|| "-".to_owned(), |power| format!("{power:.2}")),
            share(Outcome::first_is_right),
            share(Outcome::nothing_extra),
        ]
    };
    let pairs: Vec<(&Job, &Outcome)> = jobs.iter().zip(outcomes).collect();
    let groups = pairs.chunk_by(|a, b| a.0.group == b.0.group);
    let header = [
        "noise",
        "rows",
        "records",
        "mean [s]",
        "largest [s]",
        "its cause",
        "exponent of rows",
        "first correct",
        "no false finding",
    ];
    "CPU time in seconds.\n\n".to_owned() + &table(&header, groups.map(row))
}

/// Errors of the parameters, their Cramer-Rao bounds and the coverage of their 95 % intervals.
pub fn accuracy(outcomes: &[Outcome]) -> String {
    let row = |a: Accuracy| {
        let error = |part: f64| format!("{} %", significant(100.0 * part));
        let at_best = a.at_best.map_or_else(|| "-".to_owned(), error);
        vec![a.cause.to_owned(), a.name, a.estimates.to_string(), error(a.median_error), at_best, percent(a.covered)]
    };
    let summary = Summary::of("all", &outcomes.iter().collect::<Vec<_>>());
    table(
        &["cause", "parameter", "estimates", "median error", "Cramer-Rao bound", "95 % interval coverage"],
        summary.parameters.into_iter().map(row),
    )
}

/// Confusion matrix, first finding over true cause; columns are numbered as the rows, the last is for no finding.
pub fn confusion(outcomes: &[Outcome]) -> String {
    let numbers: Vec<String> = (1..=Cause::ALL.len()).map(|n| n.to_string()).collect();
    let mut header = vec!["true cause"];
    header.extend(numbers.iter().map(String::as_str));
    header.push("none");
    let row = |(index, cause): (usize, &Cause)| {
        let mut counts = vec![0; Cause::ALL.len() + 1];
        for outcome in outcomes.iter().filter(|outcome| outcome.hidden == [cause.name()]) {
            let first = outcome.found.first().and_then(|name| Cause::named(name));
            counts[first.map_or(Cause::ALL.len(), |first| first as usize)] += 1;
        }
        let cell = |count: &usize| if *count == 0 { String::new() } else { count.to_string() };
        std::iter::once(format!("{} {cause}", index + 1)).chain(counts.iter().map(cell)).collect()
    };
    table(&header, Cause::ALL.iter().enumerate().map(row))
}

/// How often each cause is named at increasing sizes, relative to the detectable size.
pub fn sensitivity(sensitivities: &[Sensitivity]) -> String {
    let sizes: Vec<String> = SIZES.iter().map(|size| format!("x {size}")).collect();
    let mut header = vec!["cause", "records", "detectable", "isolable from"];
    header.extend(sizes.iter().map(String::as_str));
    header.push("named from");
    let row = |it: &Sensitivity| {
        let mut cells = vec![
            it.cause.to_string(),
            it.records.to_string(),
            format!("{} {}", significant(it.detectable), it.unit),
            if it.isolable > 100.0 { "x > 100".to_owned() } else { format!("x {}", significant(it.isolable)) },
        ];
        cells.extend((0..SIZES.len()).map(|i| it.named.get(i).map_or(String::new(), |&named| percent(named))));
        cells.push(it.ratio.map_or_else(|| "never".to_owned(), |ratio| format!("x {ratio}")));
        cells
    };
    table(&header, sensitivities.iter().map(row))
}

/// Smallest named and smallest detectable size by cause and noise.
pub fn noise(sensitivities: &[Sensitivity]) -> String {
    let mut levels: Vec<f64> = sensitivities.iter().map(|it| it.noise_percent).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let header: Vec<String> = ["cause".to_owned(), "unit".to_owned()]
        .into_iter()
        .chain(levels.iter().map(|level| format!("{level} % noise: named (detectable)")))
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let row = |cause: &Cause| {
        let of = |level: &f64| sensitivities.iter().find(|it| it.cause == *cause && it.noise_percent == *level);
        let cell = |level: &f64| {
            let named = |it: &Sensitivity| it.size.map_or_else(|| "never".to_owned(), significant);
            of(level).map_or(String::new(), |c| format!("{} ({})", named(c), significant(c.detectable)))
        };
        let unit = cause.facts().measure.unit.to_owned();
        [cause.to_string(), unit].into_iter().chain(levels.iter().map(cell)).collect()
    };
    table(&header, Cause::ALL.iter().filter(|cause| sensitivities.iter().any(|it| it.cause == **cause)).map(row))
}

/// List of the records with a missing or false finding or a wrong verdict, one line each with its seed.
pub fn wrong(jobs: &[Job], outcomes: &[Outcome]) -> String {
    let mut text = String::new();
    for (job, outcome) in jobs.iter().zip(outcomes) {
        if !outcome.all_named() || !outcome.nothing_extra() || !outcome.verdict_is_right() {
            let Outcome { seed, hidden, verdict, found, failure, .. } = outcome;
            let found = failure.clone().unwrap_or_else(|| found.join(", "));
            let _ = writeln!(text, "{}, seed {seed}: causes [{}], {verdict} [{found}]", job.group, hidden.join(", "));
        }
    }
    text
}

/// Formats a number with three significant digits.
pub(super) fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = (2 - value.abs().log10().floor() as i32).max(0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_printed_with_three_significant_digits() {
        assert_eq!(["0.00123", "12.3", "123"].map(str::to_owned), [0.001_234, 12.34, 123.4].map(significant));
        assert_eq!((percent(0.5), percent(0.996)), ("50 %".to_owned(), "99.6 %".to_owned()));
    }
}
