//! A record made ready: what was commanded as a signal, what was read, and which stretches a fit may not see.

use std::iter;

use model::Plant;

use simulation::record::Record;
use simulation::schedule::{Between, Schedule};

use crate::record::signal::Signal;
use crate::stats::scale::bends;
use crate::stats::scale::scale;

/// What the voltage did between the rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Input {
    /// It stayed at the earlier row's
    #[default]
    Hold,
    /// It went straight to the later row's
    Linear,
    /// The report's stair, with its 0.1 s ramps
    Stair,
}

/// Parts that the record is divided into; each fold leaves out one in [`FOLDS`] of its stretches.
pub const FOLDS: usize = 5;
/// Stretches of a long record. Short beside most effects in place, long beside the noise's memory.
const STRETCHES: usize = 40;
/// Shortest stretch, in rows.
const SHORTEST_STRETCH: usize = 3;
/// Records with fewer rows are held out stair by stair, if they have so many.
const FEW_ROWS: usize = 200;
const FEWEST_STAIRS: usize = 4;

/// Pieces of the command for a first look at a long record, and what they may be off by, as a part of the full scale.
const THINNED_PIECES: usize = 8_000;
const THINNED_BLUR: f64 = 1e-3;

/// Fewest readings at rest that tell whether the spring is at rest too.
const FEWEST_AT_REST: usize = 4;
/// In so short a part of its time constant the spring hardly falls.
const SHORT: f64 = 0.3;
/// A decay so many standard deviations high is one,
const CLEAR: f64 = 5.0;
/// with one of these times the paper's time constant.
const TAUS: [f64; 3] = [0.5, 1.0, 2.0];
/// Correlation of neighbours beyond which noise is not believed to remember.
const LONGEST: f64 = 0.98;

/// The record, as every fit sees it.
#[derive(Clone, Debug)]
pub struct Data {
    /// Moments of the readings, in s.
    pub time_s: Vec<f64>,
    /// Commanded voltage, in V.
    pub voltage_v: Vec<f64>,
    /// Readings, in V.
    pub reading: Vec<f64>,
    /// The commanded voltage over time.
    pub command: Signal,
    /// Largest voltage without its sign, in V.
    pub full_scale_v: f64,
    /// Median time between rows, in s.
    pub sample_s: f64,
    /// The same for all rows of the record, of which these may be a part.
    pub command_s: f64,
    /// Readings are equally far apart.
    pub even: bool,
    /// The record begins in mid-course: how far the spring has come by then, its readings have to tell.
    pub begun: bool,
    /// The fold that each row is held out in.
    pub fold: Vec<u8>,
    /// Number of folds.
    pub folds: usize,
}

impl Data {
    /// Rows without a reading are left out; the schedule keeps their voltage.
    pub fn new(record: &Record, input: Input) -> Self {
        Self::thinned(record, input, 1)
    }

    /// The same with every so many rows' reading, under the same voltage: for a first look at a long record.
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
        // Told by all rows: a part of them is of the same record.
        let begun = first_v != 0.0 || still_falling(&time_s, &voltage_v, &reading);
        let [time_s, voltage_v, reading] = [time_s, voltage_v, reading].map(|all| match every {
            1 => all,
            _ => all.into_iter().step_by(every).collect(),
        });
        let full_scale_v = voltage_v.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let mut gaps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        gaps.sort_by(f64::total_cmp);
        let sample_s = gaps.get(gaps.len() / 2).copied().unwrap_or(1.0);
        let command_s = sample_s / every as f64;
        let even =
            gaps.last().zip(gaps.first()).is_some_and(|(longest, shortest)| longest - shortest < 0.01 * sample_s);
        // A record that begins under voltage had it before, or begins at the moment of the step.
        let first = reading.first().copied().unwrap_or(0.0);
        let stepped = first / first_v < 2.0 * Plant::PAPER.share;
        let before = if stepped { 0.0 } else { first_v };
        let command = match every {
            1 => Signal::new(&schedule, &time_s, before),
            _ => Signal::coarse(&schedule, &time_s, before, THINNED_PIECES, THINNED_BLUR * full_scale_v),
        };
        let fold = folds(&voltage_v);
        let folds = fold.iter().max().map_or(1, |&last| usize::from(last) + 1);
        Self { time_s, voltage_v, reading, command, full_scale_v, sample_s, command_s, even, begun, fold, folds }
    }

    /// Number of readings.
    pub fn rows(&self) -> usize {
        self.reading.len()
    }

    /// Time from the first to the last reading, in s.
    pub fn duration_s(&self) -> f64 {
        self.time_s.last().unwrap_or(&0.0) - self.time_s.first().unwrap_or(&0.0)
    }
}

/// True if the readings at rest, before the first voltage, fall from another stiffness to their rest as a spring does; where
/// they are too short to fall, if they are not at rest.
fn still_falling(time_s: &[f64], voltage_v: &[f64], reading: &[f64]) -> bool {
    let rest = voltage_v.iter().take_while(|voltage| **voltage == 0.0).count();
    if rest == 0 {
        return false;
    }
    let (time_s, at_rest) = (&time_s[..rest], &reading[..rest]);
    let tau_s = Plant::PAPER.time_constant_s;
    let short = rest < FEWEST_AT_REST || time_s[rest - 1] - time_s[0] < SHORT * tau_s;
    let new_v = scale(&bends(reading).collect::<Vec<_>>());
    let falls = |tau_s: f64| {
        let decay: Vec<f64> = time_s.iter().map(|time| (-(time - time_s[0]) / tau_s).exp()).collect();
        // Least squares on the decay, and on a constant if that can be told from it.
        let mean = |values: &[f64]| if short { 0.0 } else { values.iter().sum::<f64>() / rest as f64 };
        let (mean_decay, mean_reading) = (mean(&decay), mean(at_rest));
        let pairs = || decay.iter().zip(at_rest).map(|(decay, reading)| (decay - mean_decay, reading - mean_reading));
        let power: f64 = pairs().map(|(decay, _)| decay * decay).sum();
        let height = pairs().map(|(decay, reading)| decay * reading).sum::<f64>() / power;
        let left: Vec<f64> = pairs().map(|(decay, reading)| reading - height * decay).collect();
        height.abs() * power.sqrt() > CLEAR * new_v.max(of_a_sum(&left))
    };
    TAUS.iter().any(|times| falls(times * tau_s))
}

/// What noise comes to in a sum, for each root of its rows: its deviation, the larger the longer it remembers (as a first-order
/// autoregression does).
fn of_a_sum(noise: &[f64]) -> f64 {
    let power: f64 = noise.iter().map(|value| value * value).sum();
    let memory = noise.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / power.max(f64::MIN_POSITIVE);
    let memory = memory.clamp(0.0, LONGEST);
    (power / noise.len() as f64 * (1.0 + memory) / (1.0 - memory)).sqrt()
}

/// Which fold each row belongs to: whole stairs of a short record that has some, else stretches in turn.
fn folds(voltage_v: &[f64]) -> Vec<u8> {
    let rows = voltage_v.len();
    if rows < FEW_ROWS {
        let stairs: Vec<usize> = voltage_v.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
        let longest = stairs.iter().copied().max().unwrap_or(0);
        // One that holds half of the record leaves too little to learn from; rows of a sweep are no stairs.
        if stairs.len() >= FEWEST_STAIRS && 2 * stairs.len() <= rows && 2 * longest <= rows {
            let most = 2 * FOLDS;
            let of_stair = |(stair, &length): (usize, &usize)| iter::repeat_n((stair % most) as u8, length);
            return stairs.iter().enumerate().flat_map(of_stair).collect();
        }
    }
    let length = rows.div_ceil(STRETCHES).max(SHORTEST_STRETCH);
    // Each turn begins with another fold: or else, of a stair whose steps take as long as a turn, one fold had all beginnings.
    let fold_of = |stretch: usize| (stretch + 2 * (stretch / FOLDS)) % FOLDS;
    (0..rows).map(|row| fold_of(row / length) as u8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;
    use simulation::record::Row;

    #[test]
    fn few_rows_are_held_out_stair_by_stair_if_they_are_stairs() {
        let stair: Vec<f64> = (0..18).map(|row| f64::from(row / 3)).collect();
        let expected: Vec<u8> = (0..18).map(|row| row / 3).collect();
        assert_eq!(folds(&stair), expected);
        // A sweep, and a single step: stretches of neighbours, none of which holds all that there is to learn.
        for record in [(0..60).map(f64::from).collect::<Vec<_>>(), [[0.0; 10], [1.0; 10], [1.0; 10]].concat()] {
            let fold = folds(&record);
            assert!(fold.chunk_by(|a, b| a == b).all(|stretch| stretch.len() == SHORTEST_STRETCH), "{fold:?}");
            assert_eq!(fold.iter().max(), Some(&(FOLDS as u8 - 1)));
        }
    }

    /// A decay that a part of the rows cannot tell is in the record all the same, and asks for the same coordinates.
    #[test]
    fn a_part_of_the_rows_begins_as_all_of_them_do() {
        let noise = normals(4000);
        let row = |row: usize, start_v: f64| {
            let time_s = 0.01 * row as f64;
            let measured = Some(start_v * (-time_s / 5.5).exp() + noise[row]);
            Row { line: 0, time_s, voltage_v: if row < 3000 { 0.0 } else { 300.0 }, measured }
        };
        let record = |start_v| Record { name: String::new(), rows: (0..4000).map(|at| row(at, start_v)).collect() };
        for (start_v, begun) in [(0.0, false), (1.5, true)] {
            let record = record(start_v);
            for every in [1, 2, 8, 40] {
                assert_eq!(Data::thinned(&record, Input::Hold, every).begun, begun, "{start_v} V, every {every}");
            }
        }
    }

    /// What wanders by itself is no decay, and a spring that falls faster or slower than the paper's is one.
    #[test]
    fn noise_that_remembers_does_not_fall() {
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
            Data::new(&Record { name: String::new(), rows: rows.collect() }, Input::Hold).begun
        };
        // In 1.5 s the spring hardly falls, and noise that is slower than that may pass for it.
        for (at_rest, most) in [(60, 3), (16, 20)] {
            let wanders = (0..100).filter(|seed| record(&|_, noise| noise, at_rest, *seed)).count();
            assert!(wanders < most, "{at_rest} rows: {wanders} of 100");
            for tau_s in [2.0, 3.5, 8.0, 15.0] {
                let decay = |time: f64, noise| 60.0 * (-time / tau_s).exp() + noise;
                let falls = (0..100).filter(|seed| record(&decay, at_rest, *seed));
                assert!(falls.count() > 90, "{at_rest} rows, {tau_s} s");
            }
        }
    }

    /// Whatever the period of a schedule, in stretches: what happens at one of its moments is seen by every fit.
    #[test]
    fn no_fold_has_every_step() {
        let fold = folds(&[0.0; 60 * STRETCHES]);
        for period in 2..=STRETCHES / 4 {
            for phase in 0..period {
                let steps: Vec<u8> = fold.iter().copied().step_by(60).skip(phase).step_by(period).collect();
                let most = (0..FOLDS).map(|of| steps.iter().filter(|step| usize::from(**step) == of).count()).max();
                assert!(most.unwrap() < steps.len(), "{period}, {phase}: {steps:?}");
            }
        }
    }
}
