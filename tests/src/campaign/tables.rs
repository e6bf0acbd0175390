//! The campaign's results as Markdown.

use std::fmt::Write;

use super::ladder::{Climb, RUNGS};
use super::part::Job;
use super::score::Outcome;
use super::summary::{Accuracy, Summary};
use crate::hidden::Cause;

/// A table: header, then rows.
pub fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let owned: Vec<String> = header.iter().map(|&cell| cell.to_owned()).collect();
    let rule: Vec<String> = header.iter().map(|_| "---".to_owned()).collect();
    rows.into_iter().fold(line(&owned) + &line(&rule), |text, row| text + &line(&row))
}

fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    if percent.fract().abs() < 1e-9 { format!("{percent:.0} %") } else { format!("{percent:.1} %") }
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"))
}

/// Named, extra findings, verdicts, held-out error: one line a group and one for all.
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
            "first right",
            "all named",
            "nothing extra",
            "verdict right",
            "verdicts",
            "error to floor",
            "95 %",
            "time [s]",
        ],
        summaries.iter().map(row),
    )
}

/// What a diagnosis takes of a processor, and what it finds: one line a group, in each noise the shortest records first.
pub fn speed(jobs: &[Job], outcomes: &[Outcome]) -> String {
    let mut before: Option<(&str, f64, f64)> = None;
    let row = |chunk: &[(&Job, &Outcome)]| {
        let (job, _) = chunk[0];
        let count = chunk.len() as f64;
        let share = |is: fn(&Outcome) -> bool| percent(chunk.iter().filter(|(_, it)| is(it)).count() as f64 / count);
        let mean = chunk.iter().map(|(_, outcome)| outcome.seconds).sum::<f64>() / count;
        let (_, worst) = chunk.iter().max_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds)).expect("no group is empty");
        let (noise, rows) = (job.recipe.noise.kind.name(), job.recipe.rows as f64);
        let of_shorter = before.filter(|(of, ..)| *of == noise);
        let power = of_shorter.map(|(_, fewer, less)| (mean / less).ln() / (rows / fewer).ln());
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
        "worst [s]",
        "hidden in it",
        "grows as rows^",
        "first right",
        "nothing extra",
    ];
    "Seconds of one processor.\n\n".to_owned() + &table(&header, groups.map(row))
}

/// How near the parameters come and how often their bounds hold.
pub fn accuracy(outcomes: &[Outcome]) -> String {
    let row = |a: Accuracy| {
        let error = |part: f64| format!("{} %", significant(100.0 * part));
        let at_best = a.at_best.map_or_else(|| "-".to_owned(), error);
        vec![a.cause.to_owned(), a.name, a.estimates.to_string(), error(a.median_error), at_best, percent(a.covered)]
    };
    let summary = Summary::of("all", &outcomes.iter().collect::<Vec<_>>());
    table(
        &["cause", "parameter", "estimates", "median error", "at best", "95 % bounds hold"],
        summary.parameters.into_iter().map(row),
    )
}

/// First finding over hidden cause; columns are numbered as the rows, the last is for no finding.
pub fn confusion(outcomes: &[Outcome]) -> String {
    let numbers: Vec<String> = (1..=Cause::ALL.len()).map(|n| n.to_string()).collect();
    let mut header = vec!["hidden"];
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

/// How often each cause is named at the rungs of the ladder.
pub fn ladder(climbs: &[Climb]) -> String {
    let rungs: Vec<String> = RUNGS.iter().map(|rung| format!("x {rung}")).collect();
    let mut header = vec!["cause", "records", "detectable", "told apart from"];
    header.extend(rungs.iter().map(String::as_str));
    header.push("named from");
    let row = |climb: &Climb| {
        let mut cells = vec![
            climb.cause.to_string(),
            climb.records.to_string(),
            format!("{} {}", significant(climb.detectable), climb.unit),
            if climb.told_apart > 100.0 {
                "x > 100".to_owned()
            } else {
                format!("x {}", significant(climb.told_apart))
            },
        ];
        cells.extend((0..RUNGS.len()).map(|i| climb.named.get(i).map_or(String::new(), |&named| percent(named))));
        cells.push(climb.ratio.map_or_else(|| "never".to_owned(), |ratio| format!("x {ratio}")));
        cells
    };
    table(&header, climbs.iter().map(row))
}

/// The smallest size that is named, and the smallest detectable one, cause over noise.
pub fn noise(climbs: &[Climb]) -> String {
    let mut levels: Vec<f64> = climbs.iter().map(|climb| climb.noise_percent).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let header: Vec<String> = ["cause".to_owned(), "unit".to_owned()]
        .into_iter()
        .chain(levels.iter().map(|level| format!("{level} % noise: named (detectable)")))
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let row = |cause: &Cause| {
        let of = |level: &f64| climbs.iter().find(|climb| climb.cause == *cause && climb.noise_percent == *level);
        let cell = |level: &f64| {
            let named = |climb: &Climb| climb.size.map_or_else(|| "never".to_owned(), significant);
            of(level).map_or(String::new(), |c| format!("{} ({})", named(c), significant(c.detectable)))
        };
        let unit = cause.facts().measure.unit.to_owned();
        [cause.to_string(), unit].into_iter().chain(levels.iter().map(cell)).collect()
    };
    table(&header, Cause::ALL.iter().filter(|cause| climbs.iter().any(|climb| climb.cause == **cause)).map(row))
}

/// Records that went wrong, for whoever wants to look at one.
pub fn wrong(jobs: &[Job], outcomes: &[Outcome]) -> String {
    let mut text = String::new();
    for (job, outcome) in jobs.iter().zip(outcomes) {
        if !outcome.all_named() || !outcome.nothing_extra() || !outcome.verdict_is_right() {
            let Outcome { seed, hidden, verdict, found, failure, .. } = outcome;
            let found = failure.clone().unwrap_or_else(|| found.join(", "));
            let _ = writeln!(text, "{}, seed {seed}: hidden [{}], {verdict} [{found}]", job.group, hidden.join(", "));
        }
    }
    text
}

/// Three significant digits.
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
    fn numbers_keep_three_digits() {
        assert_eq!(["0.00123", "12.3", "123"].map(str::to_owned), [0.001_234, 12.34, 123.4].map(significant));
        assert_eq!((percent(0.5), percent(0.996)), ("50 %".to_owned(), "99.6 %".to_owned()));
    }
}
