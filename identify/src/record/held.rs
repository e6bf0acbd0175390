//! Readings that repeat the one before because no new one was taken or sent: a lossy link, a sample-and-hold, a sensor that reports
//! changes only, or one that is stuck for a while.
//!
//! Continuous noise does not give the same number twice, and readings on a coarse grid return to the number before last. Readings
//! that repeat but do not return were held. They say nothing new, so that a record is diagnosed without them; only if a sensor reports
//! changes, a reading that it did not report says that the response was near the last one.
//!
//! What holds them shows in the number of rows from one new reading to the next: readings that are lost leave numbers that are independent
//! of the response, a sensor that reports changes leaves few rows while the response changes and many while it rests. Such a sensor also
//! reports changes of nearly one size after very different times.

use std::borrow::Cow;
use std::ops::Range;

use simulation::record::Record;

use crate::record::quantisation_grid::QuantisationGrid;
use crate::record::stuck::{FEWEST_NEW, ROUNDING, TURNING, range, stuck};
use crate::stats::median::{median, robust_deviation};
use crate::stats::rank::rank_correlation;
use crate::stats::thresholds::empirical::{COARSEST_GRID_OF_HELD, FEWEST_TIES, LEAST_HELD, MOST_RETURNS};
use crate::stats::thresholds::probability::Z_RARE;

/// Part of the changes that is smaller than the smallest one that counts.
const SMALLEST: f64 = 0.05;
/// Smallest change, relative to the median change, that shows a threshold.
const THRESHOLD: f64 = 0.3;
/// Largest number of readings that return to the one before last, relative to those that repeat the one before, where these were held.
const RETURNS_PER_REPEAT: f64 = 0.25;
/// Size of the changes after held readings, relative to that of the others, from which they catch up.
const CATCHING_UP: f64 = 0.8;
/// Largest ratio of a voltage's changes from row to row where it moves steadily.
const STEADY: f64 = 3.0;
/// Mean number of rows from one new reading to the next, above which a clock may set it: with less, some readings are lost.
const QUICKEST_CLOCK: f64 = 1.5;
/// Scatter of the numbers of rows from one new reading to the next, relative to their mean, below which a clock sets them.
const CLOCK: f64 = 0.3;
/// Largest scatter of the sizes of changes, relative to that of their rates, where changes of one size are reported.
const SAME_SIZE: f64 = 0.5;
/// Largest part of the held readings in one run: beyond, the sensor was stuck for a while.
const LARGEST_RUN: f64 = 0.25;

/// Why readings were held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A reading is reported only after the response has changed.
    ReportsChanges,
    /// New readings are missing at random.
    Lost,
    /// The sensor takes new readings at a lower rate than the record's.
    SlowClock,
    /// The sensor was stuck for a while.
    Stuck,
}

/// What the held readings of a record show.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// Why readings were held.
    pub reason: Reason,
    /// Rows of the held readings in the record.
    pub rows: Vec<usize>,
    /// Fraction of all readings that were held, 0 to 1.
    pub fraction: f64,
    /// Smallest and median change between new readings, in the reading's unit.
    pub changes: [f64; 2],
    /// Mean age of all readings, in s, with its standard error.
    pub age_s: [f64; 2],
    /// Root mean square difference of all readings from straight lines between the new ones, in the reading's unit.
    pub error: f64,
    /// Times of the last new reading before the longest run of held ones, and of the last one in it, in s.
    pub longest_s: [f64; 2],
}

impl Held {
    /// Returns a record without its held readings.
    pub fn left_out(&self, record: &Record) -> Record {
        let mut shorter = record.clone();
        self.rows.iter().for_each(|&row| shorter.rows[row].measured = None);
        shorter
    }

    /// Returns the change from the last reading beyond which a sensor reports a new one, in the reading's unit; `None` if it reports all.
    pub fn reported_change(&self) -> Option<f64> {
        (self.reason == Reason::ReportsChanges).then_some(self.changes[0])
    }
}

/// Returns records without their held readings, for models that take each reading for a new one.
pub fn without_held(records: &[Record]) -> Cow<'_, [Record]> {
    let mut kept = Cow::Borrowed(records);
    for (index, record) in records.iter().enumerate() {
        if let Some(held) = held(record) {
            kept.to_mut()[index] = held.left_out(record);
        }
    }
    kept
}

/// Returns what the held readings of a record show; `None` if it has none.
pub fn held(record: &Record) -> Option<Held> {
    let rows: Vec<(usize, f64, f64)> =
        record.rows.iter().enumerate().filter_map(|(row, of)| Some((row, of.time_s, of.measured?))).collect();
    let (reason, new) = repeated(record, &rows).or_else(|| Some((Reason::Stuck, stuck(record, &rows)?)))?;
    let values: Vec<f64> = new.iter().map(|&row| rows[row].2).collect();
    let changes = changes(&values);
    let (mut ages, mut squares) = (Vec::new(), 0.0);
    for pair in new.windows(2) {
        let [(_, from_s, from), (_, to_s, to)] = [rows[pair[0]], rows[pair[1]]];
        for (_, time_s, value) in &rows[pair[0]..pair[1]] {
            let age_s = time_s - from_s;
            ages.push(age_s);
            squares += (value - from - (to - from) * age_s / (to_s - from_s)).powi(2);
        }
    }
    let runs = new.iter().zip(new.iter().skip(1).copied().chain([rows.len()]));
    let longest = runs.map(|(&from, to)| from..to).max_by_key(Range::len).unwrap_or(0..1);
    let rows_aged = ages.len() as f64;
    let mean_s = ages.iter().sum::<f64>() / rows_aged;
    let spread_s = (ages.iter().map(|age| (age - mean_s).powi(2)).sum::<f64>() / rows_aged).sqrt();
    let held = (0..rows.len()).filter(|row| new.binary_search(row).is_err());
    Some(Held {
        reason,
        rows: held.map(|row| rows[row].0).collect(),
        fraction: (rows.len() - new.len()) as f64 / rows.len() as f64,
        changes: [changes[(SMALLEST * changes.len() as f64) as usize], changes[changes.len() / 2]],
        age_s: [mean_s, spread_s / (new.len() as f64).sqrt()],
        error: (squares / rows_aged).sqrt(),
        longest_s: [rows[longest.start].1, rows[longest.end - 1].1],
    })
}

/// Returns why a large part of the readings, each as row, time and value, repeats the one before, and the places of the new ones in the
/// list; `None` if it does not, or the sensor was stuck for a while.
fn repeated(record: &Record, rows: &[(usize, f64, f64)]) -> Option<(Reason, Vec<usize>)> {
    let reading = |row: usize| rows[row].2;
    let [low, high] = range(&rows.iter().map(|(_, _, value)| *value).collect::<Vec<_>>());
    let equal = |one: f64, other: f64| (one - other).abs() <= ROUNDING * (high - low);
    let repeats = |row: usize| row > 0 && equal(reading(row), reading(row - 1));
    // A sensor at its bound and a spring at rest repeat readings as well; outliers may be beyond the bound.
    let bound = most_repeated((1..rows.len()).filter(|&row| repeats(row)).map(reading).collect(), equal);
    let is_special =
        |value: f64| [Some(low), Some(high), Some(0.0), bound].iter().flatten().any(|&special| equal(value, special));
    let changing: Vec<usize> = (0..rows.len()).filter(|&row| !repeats(row) || is_special(reading(row))).collect();
    let values: Vec<f64> = changing.iter().map(|&row| reading(row)).collect();
    let held_rows = rows.len() - changing.len();
    let too_few = held_rows < (LEAST_HELD.get() * rows.len() as f64) as usize;
    let changes_after = |held: bool| changes_at_rest(record, rows, &changing, held);
    let moving = || catching_up_in_movement(record, rows, &changing);
    if too_few
        || changing.len() < FEWEST_NEW
        || !is_held(&values, held_rows, equal, [true, false].map(changes_after), moving())
    {
        return None;
    }
    // A held reading may be the highest one, but a bound is reached again and again.
    let begins = |value: f64| (0..rows.len()).filter(|&row| equal(reading(row), value) && !repeats(row)).count();
    let extremes = [Some(low), Some(high), bound].into_iter().flatten();
    let bounds: Vec<f64> = extremes.filter(|&extreme| begins(extreme) >= FEWEST_TIES.count()).collect();
    let stays = |value: f64| bounds.iter().chain(&[0.0]).any(|&special| equal(value, special));
    let new: Vec<usize> = (0..rows.len()).filter(|&row| !repeats(row) || stays(reading(row))).collect();
    let count = rows.len() - new.len();
    let ends = new.iter().skip(1).copied().chain([rows.len()]);
    if new.iter().zip(ends).any(|(from, to)| (to - from - 1) as f64 > LARGEST_RUN * count as f64) {
        return None;
    }
    Some((reason(rows, &new, &changes(&values)), new))
}

/// Returns the value that more than half of some repeated readings have.
fn most_repeated(mut repeated: Vec<f64>, equal: impl Fn(f64, f64) -> bool) -> Option<f64> {
    repeated.sort_by(f64::total_cmp);
    let middle = *repeated.get(repeated.len() / 2)?;
    (2 * repeated.iter().filter(|&&value| equal(value, middle)).count() > repeated.len()).then_some(middle)
}

/// Returns the sizes of the changes between new readings under a voltage that rests, those after held readings or those without any.
fn changes_at_rest(record: &Record, rows: &[(usize, f64, f64)], new: &[usize], held: bool) -> Vec<f64> {
    let voltage = |row: usize| record.rows[rows[row].0].voltage_v;
    let rests = |pair: &[usize]| (pair[0]..pair[1]).all(|row| voltage(row) == voltage(row + 1));
    let wanted = new.windows(2).filter(|pair| (pair[1] - pair[0] > 1) == held && rests(pair));
    wanted.map(|pair| (rows[pair[1]].2 - rows[pair[0]].2).abs()).collect()
}

/// Returns the changes after held readings per row, relative to the mean of the changes of one row before and after, under a voltage that
/// moves steadily: 1 where a reading was held, the inverse of the number of rows where a slow response was rounded.
fn catching_up_in_movement(record: &Record, rows: &[(usize, f64, f64)], new: &[usize]) -> Vec<f64> {
    let change = |from: usize, to: usize| (rows[to].2 - rows[from].2).abs();
    let moves_steadily = |from: usize, to: usize| {
        let moves = (rows[from].0..rows[to].0).map(|row| record.rows[row + 1].voltage_v - record.rows[row].voltage_v);
        let [least, most] = range(&moves.collect::<Vec<_>>());
        least * most > 0.0 && least.abs().max(most.abs()) < STEADY * least.abs().min(most.abs())
    };
    let is_held = |of: &&[usize]| of[1] - of[0] == 1 && of[2] - of[1] > 1 && of[3] - of[2] == 1;
    let wanted = new.windows(4).filter(is_held).filter(|of| moves_steadily(of[0], of[3]));
    let ratio = |of: &[usize]| {
        let beside = 0.5 * (change(of[0], of[1]) + change(of[2], of[3]));
        change(of[1], of[2]) / (beside * (of[2] - of[1]) as f64)
    };
    wanted.map(ratio).filter(|ratio| ratio.is_finite()).collect()
}

/// Returns true if readings, of which none repeats the one before, are new ones of a continuous sensor that were held in between. They
/// are noise or changes of a least size, or those after held readings, the first of the given changes at rest, catch up: a rounded
/// response repeats where it hardly changes, and then changes least. So do those of [`catching_up_in_movement`].
fn is_held(
    new: &[f64],
    held_rows: usize,
    equal: impl Fn(f64, f64) -> bool,
    [after_held, others]: [Vec<f64>; 2],
    mut in_movement: Vec<f64>,
) -> bool {
    let changes = changes(new);
    let [smallest, middle] = [changes[(SMALLEST * changes.len() as f64) as usize], changes[changes.len() / 2]];
    let returns = new.windows(3).filter(|of| equal(of[2], of[0]) && !equal(of[1], of[0])).count();
    let turns = new.windows(3).filter(|of| (of[1] - of[0]) * (of[2] - of[1]) < 0.0).count();
    let part = |count: usize| count as f64 / new.len() as f64;
    let mut distinct = new.to_vec();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup_by(|a, b| equal(*a, *b));
    let grid = QuantisationGrid::of(&distinct).map_or(0.0, |grid| grid.step);
    let [held, direct] = [&after_held, &others].map(|changes| median(&mut changes.clone()).unwrap_or(0.0));
    let catches_up = after_held.len() >= FEWEST_NEW && held > CATCHING_UP * direct
        || in_movement.len() >= FEWEST_NEW && median(&mut in_movement).is_some_and(|middle| middle > CATCHING_UP);
    // A grid makes readings return nearly as often as repeat.
    let repeats = held_rows as f64 / new.len() as f64;
    part(returns) < MOST_RETURNS.get().min(RETURNS_PER_REPEAT * repeats)
        && grid < COARSEST_GRID_OF_HELD.get() * middle
        && (part(turns) > TURNING || smallest > THRESHOLD * middle || catches_up)
}

/// Returns the sizes of all changes, in ascending order.
fn changes(new: &[f64]) -> Vec<f64> {
    let mut changes: Vec<f64> =
        new.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|change| *change > 0.0).collect();
    changes.sort_by(f64::total_cmp);
    changes
}

/// Returns why readings were held, from all of them as row, time and value, the rows of the new ones, and the sizes of their changes.
///
/// The number of rows to the next new reading depends on the response if it is smaller after a larger change, beyond chance. It also does
/// if no change is small, and either successive numbers are correlated beyond chance, or all changes are nearly of one size while their
/// rates are not. Successive numbers of a link that is bad for a while are correlated as well.
fn reason(rows: &[(usize, f64, f64)], new: &[usize], changes: &[f64]) -> Reason {
    // Equal ones are readings at a bound or of a spring at rest.
    let changed = new.windows(2).filter(|pair| rows[pair[0]].2 != rows[pair[1]].2);
    let lengths: Vec<f64> = changed.map(|pair| (pair[1] - pair[0]) as f64).collect();
    let steps = new.windows(2).map(|pair| (rows[pair[0]], rows[pair[1]])).filter(|(from, to)| from.2 != to.2);
    let (sizes, rates): (Vec<f64>, Vec<f64>) = steps
        .map(|((_, from_s, from), (_, to_s, to))| ((to - from).abs().ln(), ((to - from).abs() / (to_s - from_s)).ln()))
        .unzip();
    let spread = |of: &[f64]| {
        let middle = median(&mut of.to_vec()).unwrap_or(0.0);
        robust_deviation(of.iter().map(|value| value - middle)).unwrap_or(0.0)
    };
    let none_is_small = changes[(SMALLEST * changes.len() as f64) as usize] > THRESHOLD * changes[changes.len() / 2];
    let of_one_size = spread(&sizes) < SAME_SIZE * spread(&rates);
    // A few long rests do not hide that the others are alike.
    let most = 4.0 * median(&mut lengths.to_vec()).unwrap_or(1.0);
    let clipped: Vec<f64> = lengths.iter().map(|length| length.min(most)).collect();
    let mean = clipped.iter().sum::<f64>() / clipped.len() as f64;
    let variance: f64 = clipped.iter().map(|length| (length - mean).powi(2)).sum();
    let after =
        |values: &[f64]| rank_correlation(&values[..values.len().saturating_sub(1)], clipped.get(1..).unwrap_or(&[]));
    if mean > QUICKEST_CLOCK && variance < (CLOCK * mean).powi(2) * clipped.len() as f64 {
        Reason::SlowClock
    } else if -after(&sizes) > Z_RARE || none_is_small && (of_one_size || after(&clipped) > Z_RARE) {
        Reason::ReportsChanges
    } else {
        Reason::Lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;
    use random_numbers::Lcg32;
    use simulation::record::Row;

    const ROWS: usize = 2000;

    /// A record of steps of 100 V with noise of 1 V and a time constant of 30 rows, read as `read` says: from the reading before, the
    /// new one and a random number from 0 to 1.
    fn record(read: impl Fn(f64, f64, f64) -> f64) -> Record {
        record_with(1.0, read)
    }

    /// A record under a stair whose readings `read` makes, with noise of `noise_v`, in V.
    fn record_with(noise_v: f64, read: impl Fn(f64, f64, f64) -> f64) -> Record {
        driven(|row| 100.0 * (row / 200 % 4) as f64, noise_v, read)
    }

    /// A record under `voltage_v` of each row whose readings `read` makes, with noise of `noise_v`, in V.
    fn driven(voltage_v: impl Fn(usize) -> f64, noise_v: f64, read: impl Fn(f64, f64, f64) -> f64) -> Record {
        let (mut state, mut before, mut numbers) = (0.0, 0.0, Lcg32::new(1));
        let rows = normals(ROWS).into_iter().enumerate().map(|(row, noise)| {
            let voltage_v = voltage_v(row);
            state += (voltage_v - state) / 30.0;
            before = read(before, state + noise_v * noise, numbers.uniform());
            Row { line: row, time_s: 0.1 * row as f64, voltage_v, measured: Some(before) }
        });
        Record { name: String::new(), rows: rows.collect() }
    }

    #[test]
    fn a_few_lost_readings_are_held_and_a_few_that_a_grid_repeats_are_not() {
        for part in [0.07, 0.12] {
            let lost = held(&record(|before, new, random| if random < part { before } else { new })).unwrap();
            assert!(lost.reason == Reason::Lost && (lost.fraction - part).abs() < 0.02, "{lost:?}");
        }
        for step in [0.1, 0.2, 0.3, 0.5] {
            assert_eq!(held(&record(|_, new, _| (new / step).round() * step)), None, "{step}");
        }
    }

    #[test]
    fn lost_readings_and_reports_of_changes_are_held() {
        let all = record(|before, new, random| if random < 0.4 { before } else { new });
        let lost = held(&all).unwrap();
        assert!(lost.reason == Reason::Lost && (lost.fraction - 0.4).abs() < 0.05, "{lost:?}");
        // A reading that is lost with probability p is p / (1 - p) rows old.
        assert!((lost.age_s[0] - 0.1 * 0.4 / 0.6).abs() < 4.0 * lost.age_s[1], "{lost:?}");
        let left = lost.left_out(&all).rows.iter().filter(|row| row.measured.is_some()).count();
        assert_eq!(left, ROWS - lost.rows.len());
        let sent = record(|before, new, _| if (new - before).abs() < 6.0 { before } else { new });
        let sent = held(&sent).unwrap();
        assert!(sent.reason == Reason::ReportsChanges && sent.changes[0] >= 6.0, "{sent:?}");
        let mut slow = record(|_, new, _| new);
        (0..ROWS).filter(|row| row % 3 > 0).for_each(|row| slow.rows[row].measured = slow.rows[row - 1].measured);
        assert_eq!(held(&slow).unwrap().reason, Reason::SlowClock);
    }

    /// Most readings of a good sensor do not turn. Those that were rounded, or have settled, repeat as well, and catch up with nothing.
    #[test]
    fn readings_of_a_good_sensor_that_were_lost_or_taken_at_a_slow_clock_are_held() {
        for noise_v in [0.0, 0.02, 0.1, 0.3] {
            let all = record_with(noise_v, |before, new, random| if random < 0.4 { before } else { new });
            let lost = held(&all).unwrap();
            assert!(lost.reason == Reason::Lost && (lost.fraction - 0.4).abs() < 0.05, "{noise_v}: {lost:?}");
            let mut slow = record_with(noise_v, |_, new, _| new);
            (0..ROWS).filter(|row| row % 5 > 0).for_each(|row| slow.rows[row].measured = slow.rows[row - 1].measured);
            assert_eq!(held(&slow).map(|held| held.reason), Some(Reason::SlowClock), "{noise_v}");
            for step in [0.01, 0.1, 0.5, 2.0] {
                let rounded = record_with(noise_v, |_, new, _| (new / step).round() * step);
                assert_eq!(held(&rounded), None, "{noise_v} {step}");
            }
        }
    }

    #[test]
    fn readings_that_were_lost_in_a_steady_movement_are_held_and_rounded_ones_are_not() {
        let triangle = |row: usize| 500.0 - (row as f64 % 1000.0 - 500.0).abs();
        for noise_v in [0.0, 0.05, 0.2] {
            let lost = driven(triangle, noise_v, |before, new, random| if random < 0.12 { before } else { new });
            let lost = held(&lost).unwrap();
            assert!(lost.reason == Reason::Lost && (lost.fraction - 0.12).abs() < 0.03, "{noise_v}: {lost:?}");
            for step in [0.01, 0.5, 1.5, 3.0, 8.0] {
                let rounded = driven(triangle, noise_v, |_, new, _| (new / step).round() * step);
                assert_eq!(held(&rounded), None, "{noise_v} {step}");
            }
        }
    }

    /// The noise decides when the response reports a change, so that the numbers of rows are independent.
    #[test]
    fn changes_of_one_size_after_any_time_are_reports() {
        for least in [8.0, 15.0, 20.0] {
            let all = record(|before, new, _| if (new - before).abs() < least { before } else { new });
            let sent = held(&all).unwrap();
            let change = sent.reported_change().unwrap();
            assert!((least..1.2 * least).contains(&change), "{sent:?}");
        }
    }

    /// The response hardly rests, so that one number of rows says little of the next, and changes are of many sizes.
    #[test]
    fn reports_of_a_response_that_hardly_rests_are_no_lost_readings() {
        let (mut state, mut before, mut numbers, mut voltage_v) = (0.0, 0.0, Lcg32::new(1), 0.0);
        let row = |(row, noise): (usize, f64)| {
            let drawn = numbers.draw();
            if row % 2 == 0 {
                voltage_v = f64::from(drawn >> 30) * 100.0;
            }
            state += (voltage_v - state) / 5.0;
            let new: f64 = state + noise;
            before = if (new - before).abs() < 10.0 { before } else { new };
            Row { line: row, time_s: 0.1 * row as f64, voltage_v, measured: Some(before) }
        };
        let rows = normals(ROWS).into_iter().enumerate().map(row).collect();
        assert_eq!(held(&Record { name: String::new(), rows }).unwrap().reason, Reason::ReportsChanges);
    }

    #[test]
    fn readings_of_a_link_that_is_bad_for_a_while_are_no_reports_of_changes() {
        let count = std::cell::Cell::new(0);
        let all = record(|before, new, random| {
            count.set(count.get() + 1);
            if random < if count.get() % 100 < 30 { 0.8 } else { 0.2 } { before } else { new }
        });
        assert_eq!(held(&all).unwrap().reason, Reason::Lost);
    }

    #[test]
    fn readings_on_a_grid_at_a_bound_and_without_noise_are_not_held() {
        let grid = |step: f64| record(move |_, new, _| (new / step).round() * step);
        let bound = record(|_, new, _| new.min(120.0));
        let (mut state, mut smooth) = (0.0, bound.clone());
        for row in &mut smooth.rows {
            state += (row.voltage_v - state) / 3.0;
            row.measured = Some((1e3f64 * state).round() / 1e3);
        }
        let mut beyond = bound.clone();
        (50..ROWS).step_by(150).for_each(|row| beyond.rows[row].measured = Some(500.0 + row as f64));
        for record in [grid(0.01), grid(1.0), grid(4.0), grid(12.0), bound, beyond, smooth, record(|_, new, _| new)] {
            assert!(held(&record).is_none());
        }
    }
}
