//! Measures the false-alarm rate and the power of every adequacy check on simulated records, and prints them next to the rates
//! that the table [`CHECKS`] states.
//!
//! ```text
//! cargo run -p identify --example check_rates [RECORDS]
//! ```
//!
//! Each record has 2400 rows, 0.1 s apart, under a stair of 100 V steps from 0 V to 500 V and back; the spring is the paper's,
//! the noise has a standard deviation of 1 V. Half of the records have independent noise, half first-order autoregressive noise
//! with a coefficient of 0.9. A false alarm is a finding on the true model, for `spikes` with
//! independent outliers in 1 % of the rows; the power is that for the departure in the table. The
//! printed bounds are one-sided Clopper-Pearson bounds at 95 % confidence.

use identify::Input;
use identify::adequacy::{CHECKS, Candidate, Entry, Inadequacy};
use identify::effects::index_of;
use identify::effects::model::{Block, Model};
use identify::fit::engine::{Engine, Fit};
use identify::fit::simulator::Simulator;
use identify::plant::base::Base;
use identify::record::data::Data;
use identify::record::observed::Observed;
use random_numbers::SplitMix64;
use simulation::record::{Record, Row};

const ROWS: usize = 2400;
const ROWS_PER_STEP: usize = 120;
/// Records for each rate, unless given.
const RECORDS: usize = 200;

/// What the readings of a record differ by from the model that is checked.
#[derive(Clone, Copy)]
enum Departure {
    None,
    /// The departure that the table states for this check.
    Of(&'static str),
}

fn main() {
    let records = std::env::args().nth(1).map_or(RECORDS, |count| count.parse().expect("a number of records"));
    println!("check                 false alarms         bound  stated   power              bound  stated");
    for entry in &CHECKS {
        let name = entry.check.name();
        let count = |departure| (0..records).filter(|&seed| finds(entry, departure, seed)).count();
        let (alarms, found) = (count(Departure::None), count(Departure::Of(name)));
        let (highest, lowest) = (1.0 - lower_bound(records - alarms, records), lower_bound(found, records));
        println!(
            "{name:<20} {alarms:>5} of {records:<5} {highest:>9.4} {:>7.4} {found:>5} of {records:<5} {lowest:>9.3} {:>7.3}",
            entry.false_alarm_rate, entry.power
        );
    }
}

/// True if a check finds something significant in one record.
fn finds(entry: &Entry, departure: Departure, seed: usize) -> bool {
    let outliers = match (entry.check.name(), departure) {
        ("spikes", Departure::None) => normals(seed + 100_000).into_iter().map(|number| number.abs() > 2.6).collect(),
        _ => vec![false; ROWS],
    };
    let volts = |row: usize| 100.0 * (row / ROWS_PER_STEP % 10).min(10 - row / ROWS_PER_STEP % 10) as f64;
    let row = |row: usize| Row { line: row, time_s: 0.1 * row as f64, voltage_v: volts(row), measured: Some(0.0) };
    let record = Record { name: String::new(), rows: (0..ROWS).map(row).collect() };
    let (mut data, base) = (Data::new(&record, Input::Hold), Base::paper());
    let spring = match departure {
        Departure::Of("in_step") => effect("time-constant", 11f64.ln()),
        Departure::Of("free_run" | "repetition") => effect("time-constant", 8f64.ln()),
        Departure::Of("residual_regression") => effect("time-constant", 6f64.ln()),
        _ => Model::default(),
    };
    let mut readings = Vec::new();
    Simulator::new(&data, &base).run(&spring, &mut readings);
    let mut last = 0.0;
    let coefficient: f64 = if seed.is_multiple_of(2) { 0.0 } else { 0.9 };
    let noise = normals(seed).into_iter().map(|new| {
        last = coefficient * last + (1.0 - coefficient * coefficient).sqrt() * new;
        last
    });
    let read = |(row, noise): (usize, f64)| match departure {
        Departure::Of("excitation") => 100.0,
        Departure::Of("standstill" | "no_response") => 100.0 + noise,
        // Half a period over the record.
        Departure::Of("absorbed_by_noise") => {
            readings[row] + 5.0 * (std::f64::consts::PI * row as f64 / ROWS as f64).sin() + noise
        }
        // The first two rows of every other step.
        Departure::Of("spikes") if (row / ROWS_PER_STEP).is_multiple_of(2) && row % ROWS_PER_STEP < 2 => {
            readings[row] + 30.0 + noise
        }
        _ if outliers[row] => readings[row] + 30.0 + noise,
        _ => readings[row] + noise,
    };
    data.reading = noise.enumerate().map(read).collect();
    let observed = Observed::new(&data);
    let mut engine = Engine::new(&data, &observed, &base);
    let model = if entry.check.name() == "standstill" { effect("gain-error", 1.0) } else { Model::default() };
    let fit: Fit = engine.fit_twice(model);
    match entry.check.test(&mut engine, &Candidate::unpriced(&fit)) {
        None => false,
        Some(Inadequacy::Unidentifiable(_)) => true,
        Some(Inadequacy::Unmodelled(found)) => found.significant,
    }
}

fn effect(cause: &str, point: f64) -> Model {
    Model::default().with(Block { effect: index_of(cause).expect("an effect"), form: 0 }, vec![point])
}

/// Independent, nearly normal numbers of mean 0 and variance 1.
fn normals(seed: usize) -> Vec<f64> {
    let mut numbers = SplitMix64::new(0x5bd1_e995_u64.wrapping_mul(seed as u64 + 1));
    (0..ROWS).map(|_| numbers.normal()).collect()
}

/// Lower 95 % confidence bound of a probability, by bisection: the probability at which `count` or more of `all` occur in one of
/// twenty experiments.
fn lower_bound(count: usize, all: usize) -> f64 {
    let at_least = |p: f64| {
        let mut log = all as f64 * (1.0 - p).ln();
        let mut below = 0.0;
        for k in 0..count {
            below += log.exp();
            log += ((all - k) as f64 / (k + 1) as f64 * p / (1.0 - p)).ln();
        }
        1.0 - below
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if count == 0 || at_least(middle) > 0.05 { high = middle } else { low = middle }
    }
    low
}
