//! Equations of records that no set of causes explains: how often they contain the true operation, and how well they predict.
//!
//! In: records of [`out_of_model`](crate::ground_truth::out_of_model) and [`unforeseen`](crate::ground_truth::unforeseen) laws. Out: of
//! those with the verdict `unexplained`, whether the equation of the diagnosis has a block that is true of the law, its held-out
//! error, and the error of a free run over the last 40 % of the record by what was found on the first 60 %, compared with the extended
//! simulation, the best linear model, PySINDy and SysIdentPy.

use std::fmt::Write as _;

use anyhow::Result;
use cpu_time::ThreadTime;
use identify::stats::scale::root_mean_square;
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::case::Case;
use super::diagnosis::{Hypothesis, hypothesis, hypothesis_beyond};
use super::equation_blocks::true_blocks;
use super::out_of_model;
use super::rivals::{AT_FLOOR, Answer, LEARN, identification};
use super::subject::Subject;
use super::unforeseen::Edition;
use crate::ground_truth;
use crate::markdown::table;
use crate::statistics::{median, quantile};

/// Result for one record.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Set of the law.
    pub set: &'static str,
    /// Name of the law.
    pub law: String,
    /// Seed of the record.
    pub seed: u64,
    /// Verdict of the diagnosis.
    pub verdict: String,
    /// The equation; `None` if there was none.
    pub equation: Option<String>,
    /// Codes of its blocks.
    pub blocks: Vec<String>,
    /// True if one of them is true of the law; `None` if the grammar has no block for the law.
    pub is_true: Option<bool>,
    /// Root mean square error of the true spring, in V.
    pub floor: f64,
    /// Held-out errors of the extended simulation, the best linear model and the equation, in V.
    pub held_out: [Option<f64>; 3],
    /// Error of the true spring on the last 40 %, in V.
    pub floor_beyond: f64,
    /// Errors on the last 40 % of the extended simulation, the best linear model, the equation where there is one and the extended
    /// simulation elsewhere, PySINDy and SysIdentPy, in V; `None` if the free run diverged.
    pub beyond: [Option<f64>; 5],
    /// CPU time of the diagnosis of the whole record, in s.
    pub seconds: f64,
}

/// `count` records of every law of both sets, each with the name of its set.
pub fn cases(first: u64, count: usize) -> Vec<(&'static str, Case)> {
    let forms = out_of_model::jobs(&ground_truth::out_of_model::all(), first, count).into_iter().map(Case::from);
    let laws = Edition::First.cases(first, count).into_iter().map(|case| ("unforeseen", case));
    forms.map(|case| ("out of model", case)).chain(laws).collect()
}

/// Diagnoses every record, and predicts the last 40 % of those that are not explained; with `python`, also by the other tools.
///
/// # Errors
/// A record is rejected, or a tool fails.
pub fn run(cases: &[(&'static str, Case)], python: bool, progress: &ProgressBar) -> Result<Vec<Row>> {
    let rows: Vec<Row> = cases.par_iter().map(|(set, case)| row(set, case, progress)).collect::<Result<_>>()?;
    if python { with_other_tools(cases, rows) } else { Ok(rows) }
}

fn row(set: &'static str, case: &Case, progress: &ProgressBar) -> Result<Row> {
    let Subject { hidden, record, .. } = (case.draw)(case.seed);
    let start = ThreadTime::now();
    let Hypothesis { verdict, equation, blocks, held_out } = hypothesis(&record)?;
    let seconds = start.elapsed().as_secs_f64();
    let truth = true_blocks(&case.group);
    let is_true =
        (equation.is_some() && !truth.is_empty()).then(|| blocks.iter().any(|of| truth.contains(&of.as_str())));
    let learnt = (LEARN * record.rows.len() as f64) as usize;
    let beyond = if verdict == "unexplained" { hypothesis_beyond(&record, learnt)? } else { [None; 3] };
    let left: Vec<f64> = hidden.readings.read.iter().zip(&hidden.readings.expected).map(|(read, y)| read - y).collect();
    progress.inc(1);
    Ok(Row {
        set,
        law: case.group.clone(),
        seed: case.seed,
        verdict,
        equation,
        blocks,
        is_true,
        floor: root_mean_square(&left),
        held_out,
        floor_beyond: root_mean_square(&left[learnt..]),
        beyond: [beyond[0], beyond[1], beyond[2], None, None],
        seconds,
    })
}

/// Adds the errors of PySINDy and SysIdentPy on the records that are not explained.
fn with_other_tools(cases: &[(&str, Case)], mut rows: Vec<Row>) -> Result<Vec<Row>> {
    let folder = tempfile::tempdir()?;
    for (index, ((_, case), row)) in cases.iter().zip(&rows).enumerate() {
        if row.verdict == "unexplained" {
            (case.draw)(case.seed).hidden.write(folder.path(), &format!("{index:04}"))?;
        }
    }
    let answers = identification(folder.path(), &[])?;
    for (index, row) in rows.iter_mut().enumerate() {
        for (place, tool) in [(3, "pysindy"), (4, "sysidentpy")] {
            if let Some(answer) = answers.get(format!("{index:04}")) {
                row.beyond[place] = serde_json::from_value::<Answer>(answer[tool].clone())?.rmse;
            }
        }
    }
    Ok(rows)
}

/// Markdown page.
pub fn page(rows: &[Row]) -> String {
    let unexplained: Vec<&Row> = rows.iter().filter(|row| row.verdict == "unexplained").collect();
    let with: Vec<&Row> = unexplained.iter().copied().filter(|row| row.equation.is_some()).collect();
    let judged: Vec<&Row> = with.iter().copied().filter(|row| row.is_true.is_some()).collect();
    let right = judged.iter().filter(|row| row.is_true == Some(true)).count();
    let mut text = format!(
        "\
Records of the laws of [out of model](out-of-model.md) and [unforeseen](unforeseen.md) that the diagnosis leaves `unexplained`, and the
equation that it prints for them. An equation is a hypothesis; it changes neither verdict nor causes.

{} records, {} of them unexplained, {} of these with an equation. {} of the {} equations of laws that the grammar can hold or approach
have a block that is true of the law.

",
        rows.len(),
        unexplained.len(),
        with.len(),
        right,
        judged.len()
    );
    let names = ["extended simulation", "best linear model", "equation"];
    text += "Error on held-out segments over the error of the true spring, of the records with an equation:\n\n";
    let relative = |place: usize| -> Vec<f64> {
        with.iter().map(|row| row.held_out[place].map_or(f64::INFINITY, |error| error / row.floor)).collect()
    };
    let lines = names.iter().enumerate().map(|(place, name)| counts(name, relative(place)));
    text += &table(&["model", "median", "within 10 % of the floor", "above twice the floor"], lines);
    text += "\nFree run over the last 40 % by what was found on the first 60 %, of all unexplained records. `equation` is the extended \
             simulation where the first 60 % have no equation. `diverged` counts as above twice the floor.\n\n";
    let names = ["extended simulation", "best linear model", "equation", "PySINDy", "SysIdentPy"];
    let lines =
        names.iter().enumerate().filter(|(place, _)| unexplained.iter().any(|row| row.beyond[*place].is_some()));
    let lines = lines.map(|(place, name)| {
        let error = |row: &&Row| row.beyond[place].map_or(f64::INFINITY, |error| error / row.floor_beyond);
        counts(name, unexplained.iter().map(error).collect())
    });
    text += &table(&["model", "median", "within 10 % of the floor", "above twice the floor"], lines);
    let seconds: Vec<f64> = unexplained.iter().map(|row| row.seconds).collect();
    if let (Some(median), Some(most)) = (median(&seconds), quantile(&seconds, 1.0)) {
        let _ = write!(
            text,
            "\nCPU time of the diagnosis of an unexplained record: median {median:.1} s, at most {most:.1} s.\n\n"
        );
    }
    let line = |row: &&Row| {
        let number = |of: Option<f64>| of.map_or("-".to_owned(), |of| format!("{of:.2}"));
        let held_out = row.held_out.map(number);
        let beyond = row.beyond.map(number);
        let contained = match row.is_true {
            Some(true) => "yes",
            Some(false) => "no",
            None => "-",
        };
        let equation = row.equation.as_ref().map_or("-".to_owned(), |text| format!("`{text}`"));
        let cells = [row.law.clone(), contained.to_owned(), row.blocks.join(", "), format!("{:.2}", row.floor)];
        [&cells[..], &held_out[..], &[format!("{:.2}", row.floor_beyond)], &beyond[..], &[equation]].concat()
    };
    text += "\n`-` under `true`: no equation, or a law that the grammar cannot hold. Errors in V.\n\n";
    let header = [
        "law",
        "true",
        "blocks",
        "floor",
        "held out: extended",
        "linear",
        "equation",
        "last 40 %: floor",
        "extended",
        "linear",
        "equation",
        "PySINDy",
        "SysIdentPy",
        "equation",
    ];
    text + &table(&header, unexplained.iter().map(line))
}

fn counts(name: &str, relative: Vec<f64>) -> Vec<String> {
    let median = median(&relative).unwrap_or(f64::NAN);
    let at_floor = relative.iter().filter(|error| **error <= AT_FLOOR).count();
    let far = relative.iter().filter(|error| **error > 2.0).count();
    let of = relative.len();
    vec![name.to_owned(), format!("{median:.2}"), format!("{at_floor} of {of}"), format!("{far} of {of}")]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_law_with_a_true_block_exists_and_is_named_once() {
        let laws: Vec<String> = cases(1, 1).into_iter().map(|(_, case)| case.group).collect();
        for (index, (law, blocks)) in super::super::equation_blocks::TRUE_BLOCKS.iter().enumerate() {
            assert!(laws.iter().any(|name| name == law), "{law}");
            assert!(!blocks.is_empty());
            assert!(super::super::equation_blocks::TRUE_BLOCKS[..index].iter().all(|(other, _)| other != law), "{law}");
        }
    }

    /// A record that the diagnosis leaves open, and its law.
    #[test]
    fn a_leakage_above_a_threshold_is_predicted_to_the_floor_by_its_equation() {
        let law = "leakage above a threshold";
        let (set, case) = cases(5, 1).into_iter().find(|(_, case)| case.group == law).expect("a law");
        let row = row(set, &case, &ProgressBar::hidden()).expect("a diagnosis");
        assert_eq!((row.verdict.as_str(), row.is_true), ("unexplained", Some(true)), "{row:?}");
        let [extended, linear, equation] = row.held_out.map(|error| error.expect("an error"));
        assert!(equation < AT_FLOOR * row.floor && extended > 1.5 * row.floor && linear > equation, "{row:?}");
        let [extended, _, equation, ..] = row.beyond;
        assert!(equation.expect("a free run") <= extended.expect("a free run"), "{row:?}");
    }
}
