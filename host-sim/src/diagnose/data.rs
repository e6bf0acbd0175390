//! A record made ready: what was commanded as a signal, what was read, and which stretches a fit may not see.

use crate::record::Record;
use crate::schedule::{Between, Schedule};

use super::signal::Signal;

/// What the voltage did between the rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Input {
    /// It stayed at the earlier row's
    #[default]
    Hold,
    /// It went straight to the later row's
    Linear,
    /// The report's stair, with its 0.1 s ramps
    Stair,
}

/// Parts that the record is divided into; each fold leaves out every [`FOLDS`]th of its stretches.
pub const FOLDS: usize = 5;
/// Stretches of a long record. Short beside most effects in place, long beside the noise's memory.
const STRETCHES: usize = 40;
/// Records with fewer rows are held out stair by stair.
const FEW_ROWS: usize = 200;

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
        let rows = || record.rows.iter().filter_map(|row| Some((row, row.measured?))).step_by(every);
        let time_s: Vec<f64> = rows().map(|(row, _)| row.time_s).collect();
        let voltage_v: Vec<f64> = rows().map(|(row, _)| row.voltage_v).collect();
        let reading: Vec<f64> = rows().map(|(_, reading)| reading).collect();
        let full_scale_v = voltage_v.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let mut gaps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        gaps.sort_by(f64::total_cmp);
        let sample_s = gaps.get(gaps.len() / 2).copied().unwrap_or(1.0);
        // A record that begins under voltage begins settled, or at the moment of the step: its first reading tells.
        let before = match (voltage_v.first(), reading.first()) {
            (Some(&voltage), Some(&reading)) if (reading - voltage).abs() < (reading - 0.1 * voltage).abs() => voltage,
            _ => 0.0,
        };
        let command = Signal::new(&schedule, &time_s, before);
        let fold = folds(&voltage_v);
        let folds = fold.iter().max().map_or(1, |&last| usize::from(last) + 1);
        Self { time_s, voltage_v, reading, command, full_scale_v, sample_s, fold, folds }
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

/// Which fold each row belongs to: whole stairs of a short record, stretches in turn of a long one.
fn folds(voltage_v: &[f64]) -> Vec<u8> {
    let rows = voltage_v.len();
    if rows < FEW_ROWS {
        let mut stair = 0u8;
        let mut fold = vec![0];
        for pair in voltage_v.windows(2) {
            stair = stair.saturating_add(u8::from(pair[0] != pair[1]));
            fold.push(stair);
        }
        // Many small stairs are as good as stretches.
        let most = FOLDS as u8 * 2;
        return fold.into_iter().map(|stair| stair % most).collect();
    }
    let length = rows.div_ceil(STRETCHES);
    (0..rows).map(|row| ((row / length) % FOLDS) as u8).collect()
}
