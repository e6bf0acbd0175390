//! A sensor that is stuck: it repeats one reading for a while, to the last digit, among readings that hardly ever do.
//!
//! Noise does not give the same number many times in a row. Runs of equal readings are those of a stuck sensor if all other runs are far
//! shorter, and if chance would not make one as long. A spring at rest in a simulation without noise repeats its reading as well: its
//! readings do not turn back while the voltage rests, or most of its rests end with equal readings. A bound that a reading reaches
//! gradually is that of its range; only a jump to it and back from it is a fault, or a bound that is reached once by a sensor that sticks
//! elsewhere.

use std::ops::Range;

use simulation::record::Record;

use crate::record::held::{FEWEST_NEW, ROUNDING, TURNING, range};
use crate::stats::thresholds::empirical::{FEWEST_TIES, LEAST_HELD, SHORTEST_RUN};

/// Largest length of the other runs, relative to the shortest one of a stuck sensor.
const OTHERS: f64 = 1.0 / 3.0;
/// Expected number of runs by chance, below which there are none.
const BY_CHANCE: f64 = 1e-6;
/// Part of the changes under a voltage that rests that turn back, from which readings have noise; of white noise two thirds do.
const NOISY: f64 = 0.05;
/// Shortest rest of the voltage in which a spring without noise may come to rest, in rows.
const REST: usize = 10;

/// Returns the places of the readings, each a row, a time in s and a value, that a stuck sensor did not repeat; `None` if it was not stuck.
pub(super) fn stuck(record: &Record, rows: &[(usize, f64, f64)]) -> Option<Vec<usize>> {
    let [low, high] = range(rows);
    let equal = |one: f64, other: f64| (one - other).abs() <= ROUNDING * (high - low);
    let runs = runs(rows.len(), |row| equal(rows[row].2, rows[row - 1].2));
    let shortest = shortest_stuck(&runs)?;
    let (long, others): (Vec<_>, Vec<_>) = runs.into_iter().partition(|run| run.len() >= shortest);
    let free: Vec<usize> = others.into_iter().flatten().collect();
    let is_free = |row: usize| free.binary_search(&row).is_ok();
    let rests = runs_of_voltage(record, rows);
    let ends: Vec<usize> = rests.iter().filter(|rest| rest.len() >= REST).map(|rest| rest.end - 1).collect();
    let quiet = ends.iter().filter(|&&end| !is_free(end)).count();
    let change = |row: usize| rows[row].2 - rows[row - 1].2;
    let turns = |within: &Range<usize>| {
        let triples = (within.start + 2..within.end).filter(|&row| (row - 2..=row).all(is_free));
        triples.map(|row| change(row) * change(row - 1) < 0.0).collect::<Vec<_>>()
    };
    let at_rest: Vec<bool> = rests.iter().flat_map(turns).collect();
    // A voltage that never rests keeps no spring at rest either.
    let (turns, least) = if at_rest.len() < FEWEST_NEW { (turns(&(0..rows.len())), TURNING) } else { (at_rest, NOISY) };
    let turning = turns.iter().filter(|turns| **turns).count() as f64;
    if turns.len() < FEWEST_NEW || turning < least * turns.len() as f64 || 2 * quiet > ends.len() {
        return None;
    }
    let neighbours = free.windows(2).filter(|pair| pair[1] == pair[0] + 1);
    let largest = neighbours.map(|pair| change(pair[1]).abs()).fold(0.0, f64::max);
    let jumps = |row: usize| row < rows.len() && change(row).abs() > largest;
    let value = |row: usize| rows[row].2;
    let is_special = |run: &Range<usize>| [low, high, 0.0].iter().any(|special| equal(value(run.start), *special));
    // With noise, a bound is reached again and again.
    let begins = |at: f64| (1..rows.len()).filter(|&row| equal(value(row), at) && !equal(value(row - 1), at)).count();
    let sticks = long.iter().any(|run| run.start > 0 && !is_special(run));
    let is_stuck = |run: &Range<usize>| {
        !is_special(run)
            || sticks && begins(value(run.start)) < FEWEST_TIES.count()
            || jumps(run.start) && (run.end == rows.len() || jumps(run.end))
    };
    // The first readings may be those of a spring at rest in a simulation. The reading that is repeated is a good one, or one of a jump.
    let stuck = long.into_iter().filter(|run| run.start > 0 && is_stuck(run));
    let stuck: Vec<Range<usize>> = stuck.map(|run| run.start + usize::from(!jumps(run.start))..run.end).collect();
    let new = (0..rows.len()).filter(|row| !stuck.iter().any(|run| run.contains(row))).collect();
    (!stuck.is_empty()).then_some(new)
}

/// Returns the ranges of rows that `continues` says to belong to the row before.
fn runs(rows: usize, continues: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let starts: Vec<usize> = (0..rows).filter(|&row| row == 0 || !continues(row)).collect();
    let ends = starts.iter().skip(1).copied().chain([rows]);
    starts.iter().zip(ends).map(|(&start, end)| start..end).collect()
}

/// Returns the runs of readings under one voltage.
fn runs_of_voltage(record: &Record, rows: &[(usize, f64, f64)]) -> Vec<Range<usize>> {
    let voltage = |row: usize| record.rows[rows[row].0].voltage_v;
    runs(rows.len(), |row| voltage(row) == voltage(row - 1))
}

/// Returns the least length of the runs of a stuck sensor, all others being far shorter and fewer than would make one by chance.
fn shortest_stuck(runs: &[Range<usize>]) -> Option<usize> {
    let mut lengths: Vec<usize> = runs.iter().map(Range::len).collect();
    lengths.sort_unstable();
    let rows: usize = lengths.iter().sum();
    let is_gap = |at: &usize| {
        let (shorter, length) = (&lengths[..*at], lengths[*at] as f64);
        let repeats = (shorter.iter().map(|length| length - 1).sum::<usize>().max(1)) as f64 / rows as f64;
        length >= SHORTEST_RUN.get()
            && shorter.last().is_none_or(|longest| *longest as f64 <= OTHERS * length)
            && repeats < LEAST_HELD.get()
            && rows as f64 * repeats.powf(length - 1.0) < BY_CHANCE
    };
    (0..lengths.len()).find(is_gap).map(|at| lengths[at])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::held::{Held, Reason, held};
    use crate::stats::scale::normals;
    use simulation::record::Row;

    const ROWS: usize = 2000;

    /// A record of steps of 100 V, up and down, with a time constant of 30 rows and noise, in V; `noise` has its scale at each response.
    fn record(noise: impl Fn(f64) -> f64) -> Record {
        let mut state = 0.0;
        let rows = normals(ROWS).into_iter().enumerate().map(|(row, random)| {
            let voltage_v = 100.0 * [0.0, 1.0, 2.0, 1.0, -1.0][row / 200 % 5];
            state += (voltage_v - state) / 30.0;
            let measured = Some(state + noise(state) * random);
            Row { line: row, time_s: 0.1 * row as f64, voltage_v, measured }
        });
        Record { name: String::new(), rows: rows.collect() }
    }

    fn noisy() -> Record {
        record(|_| 1.0)
    }

    /// The record with the reading of the row before each run, given by its first row and the row after it, repeated in it, or with `value`.
    fn held_in(mut record: Record, runs: &[[usize; 2]], value: Option<f64>) -> Record {
        for &[from, to] in runs {
            let repeated = value.or(record.rows[from - 1].measured);
            record.rows[from..to].iter_mut().for_each(|row| row.measured = repeated);
        }
        record
    }

    fn rows_of(runs: &[[usize; 2]]) -> Vec<usize> {
        runs.iter().flat_map(|&[from, to]| from..to).collect()
    }

    fn stuck_in(record: &Record) -> Option<Held> {
        held(record).inspect(|held| assert_eq!(held.reason, Reason::Stuck))
    }

    #[test]
    fn a_sensor_that_repeats_a_reading_for_a_while_was_stuck() {
        let several = vec![[300, 308], [950, 962], [1500, 1530]];
        for runs in [vec![[701, 716]], vec![[701, 1200]], vec![[1900, 2000]], several] {
            let stuck = stuck_in(&held_in(noisy(), &runs, None)).unwrap();
            assert_eq!(stuck.rows, rows_of(&runs));
            let longest = runs.iter().max_by_key(|[from, to]| to - from).unwrap();
            let expected = longest.map(|row| 0.1 * (row - 1) as f64);
            let is_near = |(at, expected): (&f64, f64)| (at - expected).abs() < 1e-9;
            assert!(stuck.longest_s.iter().zip(expected).all(is_near), "{stuck:?}");
        }
    }

    /// A loose contact reads 0 or the end of the range.
    #[test]
    fn a_jump_to_an_end_of_the_range_and_back_is_a_fault_of_the_sensor() {
        for value in [0.0, 999.0] {
            let stuck = stuck_in(&held_in(noisy(), &[[450, 470]], Some(value))).unwrap();
            assert_eq!(stuck.rows, rows_of(&[[450, 470]]));
        }
    }

    #[test]
    fn a_sensor_that_sticks_at_its_highest_reading_as_well_has_no_bound() {
        let mut record = noisy();
        record.rows[559].measured = Some(204.0);
        let runs = [[300, 330], [560, 600]];
        let stuck = stuck_in(&held_in(record, &runs, None)).unwrap();
        assert_eq!(stuck.rows, rows_of(&runs));
    }

    #[test]
    fn a_bound_a_grid_and_a_spring_at_rest_are_not_stuck() {
        let changed = |mut record: Record, by: &dyn Fn(f64) -> f64| {
            record.rows.iter_mut().for_each(|row| row.measured = row.measured.map(by));
            record
        };
        let bounds =
            [[-80.0, 150.0], [-500.0, 150.0]].map(|[low, high]| changed(noisy(), &|reading| reading.clamp(low, high)));
        let mut records = [vec![noisy()], bounds.to_vec()].concat();
        // Oscillations that die away, without noise and rounded.
        let (mut at, mut speed) = (0.0, 0.0);
        records.push(record(|_| 0.0));
        for row in &mut records.last_mut().unwrap().rows {
            speed += 0.5 * (row.voltage_v - at) - 0.3 * speed;
            at += speed;
            row.measured = Some((1e3f64 * at).round() / 1e3);
        }
        // Noise in proportion to the response, and none: exactly 0 for 200 rows, or rounded while it settles.
        records.extend([record(|state| 0.01 * state), record(|_| 0.0)]);
        for step in [0.01, 0.1, 0.3, 1.0, 5.0] {
            for scale in [0.0, 0.2, 1.0] {
                records.push(changed(record(|_| scale), &|reading| (reading / step).round() * step));
                records.push(changed(record(|state| 0.01 * scale * state), &|reading| (reading / step).round() * step));
            }
        }
        for (index, record) in records.iter().enumerate() {
            assert_eq!(held(record), None, "{index}");
        }
    }
}
