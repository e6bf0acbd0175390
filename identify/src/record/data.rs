//! The record prepared for fits: the commanded voltage as a signal, the readings, and the folds of cross-validation.

use std::iter;
use std::ops::Range;

use simulation::record::Record;
use simulation::schedule::{Between, Schedule};

use crate::dimension::Dimension;
use crate::record::decay::relaxes_from_earlier_input;
use crate::record::folds::folds;
use crate::record::held::held;
use crate::record::input::Input;
use crate::record::normalisation::Normalisation;
use crate::record::scales::Scales;
use crate::record::signal::Signal;
use crate::stats::median::median;
use crate::stats::scale::largest_magnitude;

/// Number of pieces of the command if only some rows of a long record are used.
const THINNED_PIECES: usize = 8_000;
/// Largest error of the chords of those pieces, as a fraction of the full scale.
const THINNED_CHORD_ERROR: f64 = 1e-3;

/// Fraction of the rows with each sign of the voltage from which a response to each sign can be found.
const ROWS_OF_SIGN: f64 = 0.1;

/// A record in the form that every fit uses; all vectors have one element per reading.
#[derive(Clone, Debug)]
pub struct Data {
    /// Time of each reading, in s, increasing.
    pub time_s: Vec<f64>,
    /// Largest distance of the true value with noise from each row's reading, in V: more than 0 where a sensor that reports changes did
    /// not report one. `None` for any other sensor.
    pub unreported_v: Option<Vec<f64>>,
    /// Commanded voltage at each reading, in V.
    pub voltage_v: Vec<f64>,
    /// Readings, in V of equivalent static voltage.
    pub reading: Vec<f64>,
    /// The commanded voltage over time, in V.
    pub command: Signal,
    /// Largest magnitude of the commanded voltage, in V.
    pub full_scale_v: f64,
    /// Largest magnitude of the commanded voltage and of the readings, in V.
    pub largest_v: f64,
    /// Voltage at which curves over the voltage begin, in V: 0, or that of the smallest magnitude if the nominal spring was identified
    /// from a record that is never near 0 V, where nothing shows the curve's part below.
    pub origin_v: f64,
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
    /// The coordinates of all these numbers, and what is expected of the spring.
    pub normalisation: Normalisation,
    /// The records that were joined; empty for a single record.
    pub parts: Vec<Part>,
}

/// One of several joined records.
#[derive(Clone, Debug)]
pub struct Part {
    /// Rows of the record among those of all records.
    pub rows: Range<usize>,
    /// Time by which it was moved to follow the record before it, in s.
    pub shift_s: f64,
    /// The record on its own, with the scales that all records share.
    pub data: Data,
}

impl Data {
    /// Prepares a record for the paper's spring, in the record's own numbers. Rows without a reading are left out; the
    /// commanded voltage keeps their values.
    pub fn new(record: &Record, input: Input) -> Self {
        Self::thinned(record, input, 1, &Normalisation::default())
    }

    /// Prepares every `every`-th reading of a normalised record, under the voltage of all rows; more than 1 for a quick
    /// search on a long record.
    pub fn thinned(record: &Record, input: Input, every: usize, normalisation: &Normalisation) -> Self {
        let schedule = match input {
            Input::Hold => Schedule::from_record(record, Between::Hold),
            Input::Linear => Schedule::from_record(record, Between::Linear),
            Input::Stair => Schedule::stair(),
        };
        let rows = || record.rows.iter().filter_map(|row| Some((row, row.measured?)));
        let time_s: Vec<f64> = rows().map(|(row, _)| row.time_s).collect();
        let voltage_v: Vec<f64> = rows().map(|(row, _)| row.voltage_v).collect();
        let reading: Vec<f64> = rows().map(|(_, reading)| reading).collect();
        let unreported_v =
            unreported(record, &normalisation.scales).map(|all| all.into_iter().step_by(every).collect());
        let first_v = voltage_v.first().copied().unwrap_or(0.0);
        let offset = normalisation.start.map_or(0.0, |start| start.offset);
        // Decided from all rows, so that a subset gets the same coordinates.
        let initial_state_unknown = normalisation.unsettled
            || first_v != 0.0
            || relaxes_from_earlier_input(&time_s, &voltage_v, &reading, offset);
        let [time_s, voltage_v, reading] = [time_s, voltage_v, reading].map(|all| match every {
            1 => all,
            _ => all.into_iter().step_by(every).collect(),
        });
        let full_scale_v = largest_magnitude(&voltage_v);
        let largest_v = reading.iter().fold(full_scale_v, |most, reading| most.max(reading.abs()));
        let origin_v = if normalisation.identified { origin(&voltage_v) } else { 0.0 };
        let mut gaps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let sample_s = median(&mut gaps).unwrap_or(1.0);
        let record_sample_s = sample_s / every as f64;
        let [longest, shortest] = [gaps.iter().copied().reduce(f64::max), gaps.iter().copied().reduce(f64::min)];
        let uniform = longest.zip(shortest).is_some_and(|(longest, shortest)| longest - shortest < 0.01 * sample_s);
        // A voltage at the first row was either applied before (the reading follows it) or is a step at that row.
        let first = reading.first().copied().unwrap_or(0.0) - offset;
        let responds_to_v = if normalisation.even { first_v.abs() } else { first_v };
        let stepped = first / responds_to_v < share_of_a_step(normalisation.share);
        let before = if stepped { 0.0 } else { first_v };
        let command = match every {
            1 => Signal::new(&schedule, &time_s, before),
            _ => Signal::coarse(&schedule, &time_s, before, THINNED_PIECES, THINNED_CHORD_ERROR * full_scale_v),
        };
        let fold = folds(&voltage_v);
        let folds = fold.iter().max().map_or(1, |&last| usize::from(last) + 1);
        Self {
            time_s,
            unreported_v,
            voltage_v,
            reading,
            command,
            full_scale_v,
            largest_v,
            origin_v,
            sample_s,
            record_sample_s,
            uniform,
            initial_state_unknown,
            fold,
            folds,
            normalisation: normalisation.clone(),
            parts: Vec::new(),
        }
    }

    /// Returns the scales of all numbers.
    pub fn scales(&self) -> &Scales {
        &self.normalisation.scales
    }

    /// Joins several records of one spring; each is simulated from its own initial state and has its own zero offset. Each record
    /// is held out as a whole. Times of a record follow those of the record before it, after a pause of one row; effects
    /// that depend on time begin anew with each record.
    pub fn joined(mut records: Vec<Data>) -> Self {
        if records.len() == 1 {
            return records.remove(0);
        }
        let longest = records.iter().max_by_key(|data| data.rows()).expect("at least one record");
        let (sample_s, record_sample_s) = (longest.sample_s, longest.record_sample_s);
        let alike = |data: &Data| data.uniform && (data.sample_s - sample_s).abs() < 0.01 * sample_s;
        let uniform = records.iter().all(alike);
        let full_scale_v = records.iter().fold(0.0, |most: f64, data| most.max(data.full_scale_v));
        let largest_v = records.iter().fold(0.0, |most: f64, data| most.max(data.largest_v));
        let mut all = Data {
            time_s: Vec::new(),
            unreported_v: None,
            voltage_v: Vec::new(),
            reading: Vec::new(),
            command: records[0].command.clone(),
            full_scale_v,
            largest_v,
            origin_v: 0.0,
            sample_s,
            record_sample_s,
            uniform,
            initial_state_unknown: records.iter().any(|data| data.initial_state_unknown),
            fold: Vec::new(),
            folds: records.len(),
            normalisation: records[0].normalisation.clone(),
            parts: Vec::new(),
        };
        for (fold, mut data) in records.into_iter().enumerate() {
            let first = all.rows();
            let shift_s = all.time_s.last().map_or(0.0, |last| last + sample_s - data.time_s[0]);
            data.time_s.iter_mut().for_each(|time_s| *time_s += shift_s);
            all.time_s.extend(&data.time_s);
            all.voltage_v.extend(&data.voltage_v);
            all.reading.extend(&data.reading);
            all.fold.extend(iter::repeat_n(fold as u8, data.rows()));
            data = Data { full_scale_v, largest_v, sample_s, record_sample_s, uniform, ..data };
            all.parts.push(Part { rows: first..first + data.rows(), shift_s, data });
        }
        all
    }

    /// Returns, for a row, the index of its record and its time in that record, in s.
    pub fn place(&self, row: usize) -> (usize, f64) {
        let index = self.parts.partition_point(|part| part.rows.end <= row);
        (index, self.time_s[row] - self.parts.get(index).map_or(0.0, |part| part.shift_s))
    }

    /// Returns the rows of each record.
    pub fn rows_of_records(&self) -> Vec<Range<usize>> {
        if !self.is_joined() {
            return std::iter::once(0..self.rows()).collect();
        }
        self.parts.iter().map(|part| part.rows.clone()).collect()
    }

    /// Returns true if the records are several.
    pub fn is_joined(&self) -> bool {
        !self.parts.is_empty()
    }

    /// Returns true if a model's prediction has parameters that are estimated for each model: an unknown initial state, a zero of
    /// one or each of several records, or gain and zero of a nominal spring that was identified from the same readings.
    pub fn has_nuisances(&self) -> bool {
        self.initial_state_unknown || self.estimates_zero() || self.is_joined()
    }

    /// Returns true if the zero of a single record's readings is estimated for each model.
    pub fn estimates_zero(&self) -> bool {
        self.normalisation.identified || self.normalisation.zero_unknown
    }

    /// Returns false if a prediction that is not linear in the initial state cannot be fitted: that of one of several records is
    /// estimated as if it were.
    pub fn estimates_any_start(&self) -> bool {
        !self.initial_state_unknown || !self.is_joined()
    }

    /// Returns the number of readings.
    pub fn rows(&self) -> usize {
        self.reading.len()
    }

    /// Returns true if the record has rows at voltages of both signs.
    pub fn has_both_signs(&self) -> bool {
        let positive = self.voltage_v.iter().filter(|voltage| **voltage > 0.0).count() as f64;
        let negative = self.voltage_v.iter().filter(|voltage| **voltage < 0.0).count() as f64;
        positive.min(negative) > ROWS_OF_SIGN * self.rows() as f64
    }

    /// Returns the time from the first to the last reading, in s; that of the longest of several records.
    pub fn duration_s(&self) -> f64 {
        if self.is_joined() {
            return self.parts.iter().map(|part| part.data.duration_s()).fold(0.0, f64::max);
        }
        self.time_s.last().unwrap_or(&0.0) - self.time_s.first().unwrap_or(&0.0)
    }
}

/// Returns the changes that were not reported, of all rows with a reading of a normalised record. They are found in the file's numbers,
/// as in `examine`: its printed digits and its zero count.
fn unreported(record: &Record, scales: &Scales) -> Option<Vec<f64>> {
    let mut file = record.clone();
    let readings = file.rows.iter_mut().filter_map(|row| row.measured.as_mut());
    readings.for_each(|reading| *reading = scales.restored(Dimension::Reading, *reading));
    let held = held(&file)?;
    let change = held.reported_change()? / scales.reading.abs();
    let rows = (0..record.rows.len()).filter(|&row| record.rows[row].measured.is_some());
    Some(rows.map(|row| if held.rows.binary_search(&row).is_ok() { change } else { 0.0 }).collect())
}

/// Smallest magnitude of the voltage, relative to the largest, of a record that is never near 0 V.
const NEVER_NEAR_ZERO: f64 = 0.1;

/// Returns the voltage with the smallest magnitude if all have the same sign and none is near 0 V, else 0, in V.
fn origin(voltage_v: &[f64]) -> f64 {
    let nearest = voltage_v.iter().copied().min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
    let largest = largest_magnitude(voltage_v);
    let far = nearest.abs() > NEVER_NEAR_ZERO * largest && voltage_v.iter().all(|v| v * nearest > 0.0);
    if far && nearest.abs() < largest { nearest } else { 0.0 }
}

/// Returns the first reading over its settled value below which the voltage of the first row is a step at that row, for a
/// spring with an instantaneous part of `share`: twice that part, but within what distinguishes it from 0 and 1.
fn share_of_a_step(share: f64) -> f64 {
    (2.0 * share).max(0.1).min((1.0 + share) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;
    use simulation::record::Row;

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
                    Data::thinned(&record, Input::Hold, every, &Normalisation::default()).initial_state_unknown,
                    initial_state_unknown,
                    "{start_v} V, every {every}"
                );
            }
        }
    }
}
