//! How many minutes an experiment takes until the diagnosis is right: the schedule of `vsj plan` compared with fixed and random ones.
//!
//! Every spring is first recorded under the report's stair. If the diagnosis of that record is not right, the next experiment of each
//! kind is recorded for 4 minutes, then, as a new experiment, for 2, 1 and 0.5, as long as the diagnosis of that record alone is
//! right: a spring is decided by the shortest experiment from which on all are right, so that a short one that happens to be right
//! does not count. All kinds have the same range, noise and time between readings.

use std::fmt::Write;

use anyhow::Result;
use indicatif::ProgressBar;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;

use super::diagnosis::{diagnose, planned};
use super::part::seed;
use super::score::Report;
use crate::ground_truth::out_of_model::form::Form;
use crate::ground_truth::{Block, Cause, Effect, LabelledRecord, Noise, Schedule};
use crate::markdown::table;

/// Durations of an experiment, in minutes.
pub const MINUTES: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
/// Minutes that count for an experiment that does not lead to the right diagnosis within the longest one.
const NOT_DECIDED: f64 = 8.0;
/// Highest voltage, in V.
const FULL_V: f64 = 500.0;
/// Time between two readings, in s.
const EVERY_S: f64 = 0.1;
/// Duration of the report's stair, in s: 20 s of rest, then 100 V more every 10 s.
const STAIR_S: f64 = 70.0;

/// A kind of schedule of the next experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The schedule of `vsj plan`.
    Planned,
    /// The report's stair, played again and again.
    Stair,
    /// Random levels, each held for a random time.
    Random,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Planned, Self::Stair, Self::Random];

    fn name(self) -> &'static str {
        match self {
            Self::Planned => "planned",
            Self::Stair => "stair",
            Self::Random => "random levels",
        }
    }
}

/// A spring with what is wrong with it.
#[derive(Clone, Debug)]
pub enum Spring {
    /// Two causes in their first forms.
    Pair(Vec<Effect>),
    /// A law that the diagnosis does not model.
    OutOfModel(Form),
}

/// A spring that is recorded, and the set in which it counts.
#[derive(Clone, Debug)]
pub struct Case {
    /// Row of the table.
    pub set: &'static str,
    /// The spring.
    pub spring: Spring,
    /// Seed of noise and random schedules.
    pub seed: u64,
}

/// The minutes until the diagnosis of a spring was right.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// Row of the table.
    pub set: &'static str,
    /// Causes or form of the spring.
    pub name: String,
    /// Seed of the spring.
    pub seed: u64,
    /// Verdict on the first record.
    pub verdict: String,
    /// Probability of a decision that the plan of the longest experiment predicted; `None` if it found nothing undecided.
    pub predicted: Option<f64>,
    /// True if the diagnosis of the first record was right, and no experiment followed.
    pub first_right: bool,
    /// Minutes of each kind from which on the diagnosis was right, in the order of [`Kind::ALL`]; `None` if that of the longest was not.
    pub minutes: [Option<f64>; 3],
    /// All diagnoses.
    pub answers: Vec<Answer>,
}

/// A diagnosis of one record of a spring.
#[derive(Clone, Debug, Serialize)]
pub struct Answer {
    /// Kind of the schedule.
    pub schedule: &'static str,
    /// Duration, in minutes.
    pub minutes: f64,
    /// Verdict.
    pub verdict: String,
    /// Named causes, in the order of the findings.
    pub found: Vec<String>,
}

/// The report's stair of 500 V, as ideal steps.
fn stair_v(time_s: f64) -> f64 {
    (100.0 * ((time_s % STAIR_S - 20.0 + 10.0) / 10.0 + 1e-9).floor()).clamp(0.0, FULL_V)
}

fn schedule(duration_s: f64, voltage_v: impl Fn(f64) -> f64) -> Schedule {
    let rows = (duration_s / EVERY_S).round() as u32;
    // Rounded, because times in a file are decimal.
    let time_s: Vec<f64> = (0..rows).map(|row| (f64::from(row) * EVERY_S * 1e9).round() / 1e9).collect();
    let voltage_v = time_s.iter().map(|&time| voltage_v(time)).collect();
    Schedule { time_s, voltage_v }
}

/// Random levels: a new one every 1 to 20 s, log-uniformly distributed; at rest at first.
fn random(seed: u64, duration_s: f64) -> Schedule {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(4);
    let mut changes = vec![(0.0, 0.0)];
    let mut at = 0.02 * duration_s;
    while at < duration_s {
        changes.push((at, FULL_V * random.random_range(0.0..=1.0)));
        at += 20f64.powf(random.random_range(0.0..1.0));
    }
    schedule(duration_s, |time| changes[changes.partition_point(|change| change.0 <= time) - 1].1)
}

impl Case {
    fn name(&self) -> String {
        match &self.spring {
            Spring::Pair(effects) => effects.iter().map(|it| it.cause.name()).collect::<Vec<_>>().join(" + "),
            Spring::OutOfModel(form) => format!("{}, {}", form.cause.name(), form.name),
        }
    }

    fn first(&self) -> Schedule {
        schedule(STAIR_S, stair_v)
    }

    /// The record of the spring under a schedule; `index` numbers the records of the spring.
    fn record(&self, schedule: &Schedule, index: u64) -> LabelledRecord {
        let noise_seed = self.seed.wrapping_add(index.wrapping_mul(7_000_003));
        match &self.spring {
            Spring::Pair(effects) => {
                LabelledRecord::new(schedule.clone(), effects.clone(), Noise::white(0.2), noise_seed)
            }
            Spring::OutOfModel(form) => form.under(self.seed, &self.first(), schedule, noise_seed),
        }
    }

    /// True if a diagnosis is `explained` by exactly the causes of a pair, or not `ambiguous` with a correct cause of a form first.
    fn is_right(&self, Answer { verdict, found, .. }: &Answer) -> bool {
        match &self.spring {
            Spring::Pair(effects) => {
                verdict == "explained"
                    && found.len() == effects.len()
                    && effects.iter().all(|effect| found.iter().any(|name| name == effect.cause.name()))
            }
            Spring::OutOfModel(form) => {
                verdict != "ambiguous" && found.first().is_some_and(|first| form.is_named(first))
            }
        }
    }

    /// Records and diagnoses the spring under shorter and shorter experiments of every kind.
    fn run(&self) -> Result<Outcome> {
        let first = diagnose(&self.record(&self.first(), 0))?;
        let answer = Answer::of("stair", STAIR_S / 60.0, &first)?;
        let mut outcome = Outcome {
            set: self.set,
            name: self.name(),
            seed: self.seed,
            verdict: answer.verdict.clone(),
            predicted: None,
            first_right: self.is_right(&answer),
            minutes: [None; 3],
            answers: vec![answer],
        };
        if outcome.first_right {
            return Ok(outcome);
        }
        for (place, kind) in Kind::ALL.into_iter().enumerate() {
            for (index, minutes) in (1u64..).zip(MINUTES.into_iter().rev()) {
                let next = match kind {
                    Kind::Planned => {
                        let (commands, probability) = planned(&first, minutes)?;
                        outcome.predicted = outcome.predicted.or(probability);
                        let at = |time: f64| commands[commands.partition_point(|it| it.0 <= time + 1e-6) - 1].1;
                        schedule(60.0 * minutes, at)
                    }
                    Kind::Stair => schedule(60.0 * minutes, stair_v),
                    Kind::Random => random(self.seed, 60.0 * minutes),
                };
                // The noise of a record depends on its duration alone.
                let report = diagnose(&self.record(&next, index))?;
                outcome.answers.push(Answer::of(kind.name(), minutes, &report)?);
                if !self.is_right(&outcome.answers[outcome.answers.len() - 1]) {
                    break;
                }
                outcome.minutes[place] = Some(minutes);
            }
        }
        Ok(outcome)
    }
}

impl Answer {
    fn of(schedule: &'static str, minutes: f64, report: &Value) -> Result<Self> {
        let Report { findings, verdict, .. } = serde_json::from_value(report.clone())?;
        let found = findings.into_iter().map(|finding| finding.cause).collect();
        Ok(Self { schedule, minutes, verdict, found })
    }
}

/// `count` random pairs of causes that a voltage can show, of 0.15 times their full size, and one record of each form of the out-of-model
/// set with such a cause, `count` at most.
pub fn cases(forms: &[Form], first: u64, count: usize) -> Vec<Case> {
    let mut random = ChaCha8Rng::seed_from_u64(seed(first, 19, 0));
    let causes: Vec<Cause> = Cause::ALL.into_iter().filter(|cause| cause.block() != Block::Reading).collect();
    let mut pairs: Vec<[Cause; 2]> =
        causes.iter().enumerate().flat_map(|(i, &a)| causes[i + 1..].iter().map(move |&b| [a, b])).collect();
    pairs.shuffle(&mut random);
    let stair = schedule(STAIR_S, stair_v);
    let mut draw = |pair: [Cause; 2]| {
        let of = |cause: Cause| Effect::draw(&mut random, cause, 0, &stair, Noise::white(0.2).sigma_v).at(SIZE);
        Spring::Pair(pair.map(of).to_vec())
    };
    let pairs: Vec<Spring> = pairs.into_iter().cycle().take(count).map(&mut draw).collect();
    let mut forms: Vec<Form> = forms.iter().filter(|form| form.cause.block() != Block::Reading).copied().collect();
    forms.shuffle(&mut random);
    let forms = forms.into_iter().take(count).map(Spring::OutOfModel);
    let sets = pairs.into_iter().map(|spring| ("pairs", spring)).chain(forms.map(|spring| ("out of model", spring)));
    sets.enumerate().map(|(index, (set, spring))| Case { set, spring, seed: seed(first, 19, index) }).collect()
}

/// Size of the causes of a pair.
const SIZE: f64 = 0.15;

/// Runs the cases on all cores; the outcomes are in their order.
///
/// # Errors
/// A record is rejected, or a plan fails.
pub fn run(cases: &[Case], progress: &ProgressBar) -> Result<Vec<Outcome>> {
    let one = |case: &Case| {
        let outcome = case.run();
        progress.inc(1);
        outcome
    };
    cases.par_iter().map(one).collect()
}

/// Page with a table of both sets and a table of the springs.
pub fn page(outcomes: &[Outcome]) -> String {
    let mut text = format!(
        "\
Minutes of the next experiment from which on the diagnosis of its record alone is right, after a first record under the report's stair
(70 s). Pairs: two causes of {SIZE} times their full size; right is `explained` by both and nothing else. Out of model: laws that the
diagnosis does not have; right is a correct first name, not `ambiguous`. White noise of {} V, a reading every {EVERY_S} s, 0 to {FULL_V} V. An
experiment that is not right at {} minutes counts as {NOT_DECIDED}.

",
        Noise::white(0.2).sigma_v,
        MINUTES[MINUTES.len() - 1],
    );
    let mut sets: Vec<&str> = outcomes.iter().map(|outcome| outcome.set).collect();
    sets.dedup();
    let rows = sets.iter().flat_map(|set| {
        let of: Vec<&Outcome> = outcomes.iter().filter(|it| it.set == *set && !it.first_right).collect();
        Kind::ALL.into_iter().enumerate().map(move |(place, kind)| row(set, kind, &of, place)).collect::<Vec<_>>()
    });
    let header = ["springs", "schedule", "of", "0.5 min", "1", "2", "4", "mean minutes", "planned, relative"];
    text += &table(&header, rows);
    for set in &sets {
        let (all, right): (Vec<&Outcome>, Vec<&Outcome>) = (
            outcomes.iter().filter(|it| it.set == *set).collect(),
            outcomes.iter().filter(|it| it.set == *set && it.first_right).collect(),
        );
        writeln!(text, "\nOf {} springs ({set}), the first record alone shows {} right.", all.len(), right.len())
            .expect("a string");
    }
    let minutes = |minutes: Option<f64>| minutes.map_or_else(|| "-".to_owned(), |minutes| minutes.to_string());
    let springs = outcomes.iter().filter(|it| !it.first_right).map(|it| {
        let mut cells = vec![it.name.clone(), it.verdict.clone()];
        cells.push(it.predicted.map_or_else(|| "-".to_owned(), |predicted| format!("{predicted:.2}")));
        cells.extend(it.minutes.map(minutes));
        cells
    });
    let header = ["spring", "first verdict", "predicted", "planned", "stair", "random"];
    text + "\n" + &table(&header, springs)
}

/// Cells of one kind of schedule: how many springs it has decided after each duration.
fn row(set: &str, kind: Kind, of: &[&Outcome], place: usize) -> Vec<String> {
    let within = |minutes: f64| of.iter().filter(|it| it.minutes[place].is_some_and(|own| own <= minutes)).count();
    let mean = |place: usize| {
        let sum: f64 = of.iter().map(|it| it.minutes[place].unwrap_or(NOT_DECIDED)).sum();
        sum / of.len().max(1) as f64
    };
    let mut cells = vec![set.to_owned(), kind.name().to_owned(), of.len().to_string()];
    cells.extend(MINUTES.map(|minutes| within(minutes).to_string()));
    cells.push(format!("{:.2}", mean(place)));
    cells.push(format!("{:.2}", mean(0) / mean(place)));
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stair_is_the_reports_and_repeats() {
        let at = [0.0, 19.9, 20.0, 30.0, 60.0, 69.9, 70.0, 90.0].map(stair_v);
        assert_eq!(at, [0.0, 0.0, 100.0, 200.0, 500.0, 500.0, 0.0, 100.0]);
    }

    #[test]
    fn a_spring_has_the_same_law_in_every_record_and_other_noise() {
        let cases = cases(&crate::ground_truth::out_of_model::all(), 1, 2);
        assert_eq!(cases.len(), 4);
        for case in &cases {
            let [one, other] = [1, 2].map(|index| case.record(&case.first(), index));
            let expected = |record: &LabelledRecord| record.readings.expected.clone();
            assert_eq!(expected(&one), expected(&other), "{}", case.name());
            assert_ne!(one.readings.read, other.readings.read, "{}", case.name());
        }
    }
}
