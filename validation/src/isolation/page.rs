//! The page of the isolation bank.

use std::fmt::Write;

use anyhow::{Result, anyhow};
use model::isolation::{Settings, bank};
use rayon::prelude::*;

use super::run::RUN_S;
use super::watched::RATE_HZ;
use super::{Fault, NOISES, SIZES, Thresholds, Watch, known, predicted_per_block, rows, run, sizes, summary, table};

/// First seed of the runs from which the rival's bands are found; no table has it.
const RIVAL_SEEDS: u64 = 900_000;
/// Number of these runs.
const RIVAL_RUNS: u64 = 30;
/// Paths of the importance sampling, for each test.
const PATHS: u32 = 100_000;
/// Runs of 500 s at the bank's own threshold: 10^8 ticks.
const LONG_RUNS: u64 = 200;
/// Error of the model that one of the rows tolerates.
const TOLERATED: f64 = 0.005;
/// Title of the results.
pub const TITLE: &str = "## Results\n";
/// Seconds in a day.
const DAY_S: f64 = 86_400.0;

/// Runs every fault at every size and noise, and counts false alarms.
///
/// # Errors
/// The model rejects the settings.
pub fn page(first_seed: u64, runs: u64) -> Result<String> {
    let mut text = format!("{TITLE}\nRuns of {RUN_S} s at 1 kHz, {runs} of each fault and size.\n\n");
    let refused = |error: model::OutOfRange| anyhow!("{error}");
    for percent in NOISES {
        let thresholds = thresholds(percent).map_err(refused)?;
        let rows = rows(percent, first_seed..first_seed + runs, &thresholds).map_err(refused)?;
        write!(text, "### Noise of {percent} %\n\n{}\n{}\n", summary(&rows), table(&rows))?;
        write!(text, "Reported sizes at the end of the runs with the right name:\n\n{}\n", sizes(&rows))?;
    }
    let known = known::table(first_seed, runs.div_ceil(2)).map_err(refused)?;
    write!(text, "### A model that is known to within intervals\n\n{known}\n")?;
    text += &false_alarms(first_seed)?;
    Ok(text)
}

/// The rival's bands: 1.2 times the largest deviations in runs without a fault.
fn thresholds(percent: f64) -> Result<Thresholds, model::OutOfRange> {
    let open = Thresholds([f64::INFINITY; 3]);
    let seeds = (RIVAL_SEEDS..RIVAL_SEEDS + RIVAL_RUNS).into_par_iter();
    let outcomes: Vec<_> =
        seeds.map(|seed| run(Fault::None, SIZES[0], percent, seed, &open)).collect::<Result<_, _>>()?;
    let largest = |index: usize| outcomes.iter().map(|outcome| outcome.deviations[index]).fold(0.0, f64::max);
    Ok(Thresholds(std::array::from_fn(|index| 1.2 * largest(index))))
}

fn false_alarms(first_seed: u64) -> Result<String> {
    let mut text = "### False alarms\n\n".to_owned();
    let block_s = bank::block_s(RATE_HZ);
    let mut lines = Vec::new();
    let [small, large] = NOISES;
    let nats = Settings::PAPER.alarm_nats;
    for (percent, tolerated, nats, seeds) in [
        (small, 0.0, 8.0, 8),
        (small, 0.0, 10.0, 24),
        (small, 0.0, nats, LONG_RUNS),
        (large, 0.0, nats, LONG_RUNS),
        (small, TOLERATED, nats, LONG_RUNS),
    ] {
        let watch = Watch { percent, tolerated, nats };
        let counted = watch.count(first_seed..first_seed + seeds).map_err(|error| anyhow!("{error}"))?;
        let bound = predicted_per_block(nats, PATHS);
        lines.push(vec![
            format!("{percent} %"),
            format!("{} %", 100.0 * tolerated),
            format!("{nats}"),
            format!("{:.1}", counted.ticks as f64 / 1e6),
            counted.alarms.to_string(),
            format!("{:.2}", bound * counted.ticks as f64 / RATE_HZ / block_s),
            format!("{:.3}", block_s / bound / DAY_S),
        ]);
    }
    let header = [
        "noise",
        "tolerance",
        "threshold, nats",
        "million ticks",
        "alarms",
        "at most, by importance sampling",
        "days between alarms, at least",
    ];
    text += &crate::markdown::table(&header, lines);
    Ok(text)
}
