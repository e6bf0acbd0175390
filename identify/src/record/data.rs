//! The record prepared for fits: the commanded voltage as a signal, the readings, and the folds of cross-validation.

use std::iter;

use model::Plant;

use simulation::record::Record;
use simulation::schedule::{Between, Schedule};

use crate::record::signal::Signal;
use crate::stats::scale::robust_scale;
use crate::stats::scale::second_differences;

/// Voltage between two rows of the record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Input {
    /// The voltage stays at the value of the earlier row.
    #[default]
    Hold,
    /// The voltage is linear between the rows.
    Linear,
    /// The voltage is the report's stair with its ramps of 0.1 s.
    Stair,
}

/// Number of folds; each holds out every [`FOLDS`]-th segment of the record.
pub const FOLDS: usize = 5;
/// Number of segments of a long record: short compared with the extent of most effects, long compared with the noise's
/// autocorrelation.
const SEGMENTS: usize = 40;
/// Length of the shortest segment, in rows.
const SHORTEST_SEGMENT: usize = 3;
/// Records with fewer rows than this are held out stair by stair, if they have at least [`FEWEST_STAIRS`] stairs.
const FEW_ROWS: usize = 200;
/// Smallest number of stairs of a short record that is held out stair by stair.
const FEWEST_STAIRS: usize = 4;

/// Number of pieces of the command if only some rows of a long record are used.
const THINNED_PIECES: usize = 8_000;
/// Largest error of the chords of those pieces, as a fraction of the full scale.
const THINNED_CHORD_ERROR: f64 = 1e-3;

/// Smallest number of readings before the first voltage that can show a decay.
const FEWEST_AT_REST: usize = 4;
/// A rest shorter than this fraction of the time constant is too short to show a decay.
const SHORT_REST: f64 = 0.3;
/// A decay is significant if its amplitude is this many standard deviations.
const SIGNIFICANT_DECAY: f64 = 5.0;
/// Time constants of the decays that are tried, relative to the paper's.
const DECAY_TIMES: [f64; 3] = [0.5, 1.0, 2.0];
/// Largest lag-1 correlation of the noise that is assumed.
const LARGEST_CORRELATION: f64 = 0.98;

/// A record in the form that every fit uses; all vectors have one element per reading.
#[derive(Clone, Debug)]
pub struct Data {
    /// Time of each reading, in s, increasing.
    pub time_s: Vec<f64>,
    /// Commanded voltage at each reading, in V.
    pub voltage_v: Vec<f64>,
    /// Readings, in V of equivalent static voltage.
    pub reading: Vec<f64>,
    /// The commanded voltage over time, in V.
    pub command: Signal,
    /// Largest magnitude of the commanded voltage, in V.
    pub full_scale_v: f64,
    /// Median time between the rows in use, in s.
    pub sample_s: f64,
    /// Median time between all rows of the record, of which only some may be in use, in s.
    pub record_sample_s: f64,
    /// True if the readings are uniformly sampled: their intervals differ by less than 1 % of the median.
    pub uniform: bool,
    /// True if the spring may not have been at rest at the first reading: its initial state has to be estimated from
    /// the readings.
    pub initial_state_unknown: bool,
    /// The fold in which each row is held out.
    pub fold: Vec<u8>,
    /// Number of folds.
    pub folds: usize,
}

impl Data {
    /// Prepares a record. Rows without a reading are left out; the commanded voltage keeps their values.
    pub fn new(record: &Record, input: Input) -> Self {
        Self::thinned(record, input, 1)
    }

    /// Prepares every `every`-th reading of a record, under the voltage of all rows, for a quick search on a long
    /// record.
    pub fn thinned(record: &Record, input: Input, every: usize) -> Self {
        let schedule = match input {
            Input::Hold => Schedule::from_record(record, Between::Hold),
            Input::Linear => Schedule::from_record(record, Between::Linear),
            Input::Stair => Schedule::stair(),
        };
        let rows = || record.rows.iter().filter_map(|row| Some((row, row.measured?)));
        let time_s: Vec<f64> = rows().map(|(row, _)| row.time_s).collect();
        let voltage_v: Vec<f64> = rows().map(|(row, _)| row.voltage_v).collect();
        let reading: Vec<f64> = rows().map(|(_, reading)| reading).collect();
        let first_v = voltage_v.first().copied().unwrap_or(0.0);
        // Decided from all rows, so that a subset gets the same coordinates.
        let initial_state_unknown = first_v != 0.0 || relaxes_from_earlier_input(&time_s, &voltage_v, &reading);
        let [time_s, voltage_v, reading] = [time_s, voltage_v, reading].map(|all| match every {
            1 => all,
            _ => all.into_iter().step_by(every).collect(),
        });
        let full_scale_v = voltage_v.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let mut gaps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        gaps.sort_by(f64::total_cmp);
        let sample_s = gaps.get(gaps.len() / 2).copied().unwrap_or(1.0);
        let record_sample_s = sample_s / every as f64;
        let uniform =
            gaps.last().zip(gaps.first()).is_some_and(|(longest, shortest)| longest - shortest < 0.01 * sample_s);
        // A voltage at the first row was either applied before (the reading follows it) or is a step at that row.
        let first = reading.first().copied().unwrap_or(0.0);
        let stepped = first / first_v < 2.0 * Plant::PAPER.share;
        let before = if stepped { 0.0 } else { first_v };
        let command = match every {
            1 => Signal::new(&schedule, &time_s, before),
            _ => Signal::coarse(&schedule, &time_s, before, THINNED_PIECES, THINNED_CHORD_ERROR * full_scale_v),
        };
        let fold = folds(&voltage_v);
        let folds = fold.iter().max().map_or(1, |&last| usize::from(last) + 1);
        Self {
            time_s,
            voltage_v,
            reading,
            command,
            full_scale_v,
            sample_s,
            record_sample_s,
            uniform,
            initial_state_unknown,
            fold,
            folds,
        }
    }

    /// Returns the number of readings.
    pub fn rows(&self) -> usize {
        self.reading.len()
    }

    /// Returns the time from the first to the last reading, in s.
    pub fn duration_s(&self) -> f64 {
        self.time_s.last().unwrap_or(&0.0) - self.time_s.first().unwrap_or(&0.0)
    }
}

/// Returns true if the readings before the first voltage contain an exponential decay from an earlier stiffness; where
/// the rest is too short to show a decay, if the readings differ from zero.
fn relaxes_from_earlier_input(time_s: &[f64], voltage_v: &[f64], reading: &[f64]) -> bool {
    let rest = voltage_v.iter().take_while(|voltage| **voltage == 0.0).count();
    if rest == 0 {
        return false;
    }
    let (time_s, at_rest) = (&time_s[..rest], &reading[..rest]);
    let tau_s = Plant::PAPER.time_constant_s;
    let short = rest < FEWEST_AT_REST || time_s[rest - 1] - time_s[0] < SHORT_REST * tau_s;
    let new_v = robust_scale(&second_differences(reading).collect::<Vec<_>>());
    let falls = |tau_s: f64| {
        let decay: Vec<f64> = time_s.iter().map(|time| (-(time - time_s[0]) / tau_s).exp()).collect();
        // Least squares on the decay, and on a constant where the two can be distinguished.
        let mean = |values: &[f64]| if short { 0.0 } else { values.iter().sum::<f64>() / rest as f64 };
        let (mean_decay, mean_reading) = (mean(&decay), mean(at_rest));
        let pairs = || decay.iter().zip(at_rest).map(|(decay, reading)| (decay - mean_decay, reading - mean_reading));
        let power: f64 = pairs().map(|(decay, _)| decay * decay).sum();
        let height = pairs().map(|(decay, reading)| decay * reading).sum::<f64>() / power;
        let left: Vec<f64> = pairs().map(|(decay, reading)| reading - height * decay).collect();
        height.abs() * power.sqrt() > SIGNIFICANT_DECAY * new_v.max(scaled_deviation_of_sum(&left))
    };
    DECAY_TIMES.iter().any(|times| falls(times * tau_s))
}

/// Returns the standard deviation of the sum of autocorrelated noise over `n` rows, divided by `sqrt(n)`: `sigma
/// sqrt((1 + rho) / (1 - rho))` for a first-order autoregression with lag-1 correlation `rho`.
fn scaled_deviation_of_sum(noise: &[f64]) -> f64 {
    let power: f64 = noise.iter().map(|value| value * value).sum();
    let memory = noise.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / power.max(f64::MIN_POSITIVE);
    let memory = memory.clamp(0.0, LARGEST_CORRELATION);
    (power / noise.len() as f64 * (1.0 + memory) / (1.0 - memory)).sqrt()
}

/// Returns the fold of each row: whole stairs of a short record with enough stairs, else segments of equal length in
/// turn.
fn folds(voltage_v: &[f64]) -> Vec<u8> {
    let rows = voltage_v.len();
    if rows < FEW_ROWS {
        let stairs: Vec<usize> = voltage_v.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
        let longest = stairs.iter().copied().max().unwrap_or(0);
        // A stair with half of the rows leaves too little to fit, and the rows of a sweep are no stairs.
        if stairs.len() >= FEWEST_STAIRS && 2 * stairs.len() <= rows && 2 * longest <= rows {
            let most = 2 * FOLDS;
            let of_stair = |(stair, &length): (usize, &usize)| iter::repeat_n((stair % most) as u8, length);
            return stairs.iter().enumerate().flat_map(of_stair).collect();
        }
    }
    let length = rows.div_ceil(SEGMENTS).max(SHORTEST_SEGMENT);
    // Each round begins with another fold; otherwise one fold would hold out all steps of a stair whose period is one
    // round.
    let fold_of = |stretch: usize| (stretch + 2 * (stretch / FOLDS)) % FOLDS;
    (0..rows).map(|row| fold_of(row / length) as u8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;
    use simulation::record::Row;

    #[test]
    fn short_records_are_held_out_stair_by_stair_if_they_have_stairs() {
        let stair: Vec<f64> = (0..18).map(|row| f64::from(row / 3)).collect();
        let expected: Vec<u8> = (0..18).map(|row| row / 3).collect();
        assert_eq!(folds(&stair), expected);
        // A sweep and a single step are divided into segments of equal length.
        for record in [(0..60).map(f64::from).collect::<Vec<_>>(), [[0.0; 10], [1.0; 10], [1.0; 10]].concat()] {
            let fold = folds(&record);
            assert!(fold.chunk_by(|a, b| a == b).all(|stretch| stretch.len() == SHORTEST_SEGMENT), "{fold:?}");
            assert_eq!(fold.iter().max(), Some(&(FOLDS as u8 - 1)));
        }
    }

    /// A decay that only all rows together show is also assumed for every subset of the rows.
    #[test]
    fn subset_of_rows_has_the_same_initial_state_flag() {
        let noise = normals(4000);
        let row = |row: usize, start_v: f64| {
            let time_s = 0.01 * row as f64;
            let measured = Some(start_v * (-time_s / 5.5).exp() + noise[row]);
            Row { line: 0, time_s, voltage_v: if row < 3000 { 0.0 } else { 300.0 }, measured }
        };
        let record = |start_v| Record { name: String::new(), rows: (0..4000).map(|at| row(at, start_v)).collect() };
        for (start_v, initial_state_unknown) in [(0.0, false), (1.5, true)] {
            let record = record(start_v);
            for every in [1, 2, 8, 40] {
                assert_eq!(
                    Data::thinned(&record, Input::Hold, every).initial_state_unknown,
                    initial_state_unknown,
                    "{start_v} V, every {every}"
                );
            }
        }
    }

    /// Autocorrelated noise is not taken for a decay; a decay faster or slower than the paper's time constant is
    /// recognised.
    #[test]
    fn autocorrelated_noise_is_not_taken_for_a_decay() {
        let record = |row: &dyn Fn(f64, f64) -> f64, at_rest: usize, seed: usize| {
            let noise = normals(3000 + seed).split_off(seed);
            let remembered = noise.iter().scan(0.0, |last, noise| {
                *last = 0.9 * *last + noise;
                Some(*last)
            });
            let rows = remembered.zip(&noise).enumerate().map(|(index, (slow, quick))| {
                let time_s = 0.1 * index as f64;
                let voltage_v = if index < at_rest { 0.0 } else { 300.0 };
                Row {
                    line: 0,
                    time_s,
                    voltage_v,
                    measured: Some(row(time_s, if seed.is_multiple_of(2) { slow } else { *quick })),
                }
            });
            Data::new(&Record { name: String::new(), rows: rows.collect() }, Input::Hold).initial_state_unknown
        };
        // In 1.5 s the spring hardly relaxes, so slow noise may be taken for a decay in up to 20 % of the records.
        for (at_rest, most) in [(60, 3), (16, 20)] {
            let mistaken = (0..100).filter(|seed| record(&|_, noise| noise, at_rest, *seed)).count();
            assert!(mistaken < most, "{at_rest} rows: {mistaken} of 100");
            for tau_s in [2.0, 3.5, 8.0, 15.0] {
                let decay = |time: f64, noise| 60.0 * (-time / tau_s).exp() + noise;
                let falls = (0..100).filter(|seed| record(&decay, at_rest, *seed));
                assert!(falls.count() > 90, "{at_rest} rows, {tau_s} s");
            }
        }
    }

    /// For no period of a schedule, in segments, does one fold hold out all of its steps.
    #[test]
    fn no_fold_holds_out_every_step() {
        let fold = folds(&[0.0; 60 * SEGMENTS]);
        for period in 2..=SEGMENTS / 4 {
            for phase in 0..period {
                let steps: Vec<u8> = fold.iter().copied().step_by(60).skip(phase).step_by(period).collect();
                let most = (0..FOLDS).map(|of| steps.iter().filter(|step| usize::from(**step) == of).count()).max();
                assert!(most.unwrap() < steps.len(), "{period}, {phase}: {steps:?}");
            }
        }
    }
}
