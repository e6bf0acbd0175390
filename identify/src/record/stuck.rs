//! A sensor that is stuck: it repeats one reading for a while, to the last digit, although the response changes.
//!
//! A spring at rest repeats its reading as well if there is no noise, or less than a step of the sensor. So equal readings alone prove
//! nothing. A run of them is a fault of the sensor if it is far longer than all others, more than chance makes, and
//!
//! - is preceded and followed by noise while the voltage rests, or
//! - ends with a jump although the voltage has rested, or rests there if the run began in the middle of a movement, as the reading
//!   catches up with the response, or
//! - began before a change of the voltage after which the readings move elsewhere, or
//! - begins and ends in the middle of a movement, while a voltage that never rests keeps changing as it does elsewhere.
//!
//! Of a sensor that sticks once, the other long runs are faults as well. So is one if the readings jump to one value and back from it by
//! more than they ever change, while the voltage rests: a loose contact, of which every other jump to that value and back is a fault. At
//! an end of the range, at a bound or at 0, only such jumps prove a fault, or a sensor that sticks elsewhere, or a single run that begins
//! like any movement and ends with a jump of more than the readings ever change, while the voltage rests: a bound is kept as long as the
//! response is beyond it, and an outlier or a shift may end that.

use std::ops::Range;

use simulation::record::Record;

use crate::record::bounds::Bounds;
use crate::stats::median::median;
use crate::stats::thresholds::empirical::{FEWEST_TIES, MOST_REPEATED, SHORTEST_RUN};

/// Largest difference of equal readings, relative to the range of all: what converting between units leaves.
pub(super) const ROUNDING: f64 = 1e-12;
/// Part of the changes that turn back, from which readings are noise and not a smooth curve; of white noise two thirds do.
pub(super) const TURNING: f64 = 0.2;
/// Fewest new readings.
pub(super) const FEWEST_NEW: usize = 30;
/// Largest length of the other runs, relative to the shortest one of a stuck sensor.
const OTHERS: f64 = 1.0 / 3.0;
/// Expected number of runs by chance, below which there are none.
const BY_CHANCE: f64 = 1e-6;
/// Part of the changes under a voltage that rests that turn back, from which readings have noise; of white noise two thirds do.
const NOISY: f64 = 0.05;
/// Smallest change of the voltage that counts, relative to its range.
const CHANGE: f64 = 0.1;
/// Rows around a jump in which the voltage has to rest.
const MARGIN: usize = 2;
/// Smallest jump of a reading that catches up, and smallest movement after a change of the voltage, in median changes from row to row.
const MOVES: f64 = 5.0;
/// Rows after a jump in which the reading may not return: one that does was an outlier.
const AFTER: usize = 3;
/// Rows before a run and after it that show noise, and their least range in smallest changes: a coarse reading changes by one or two.
const BESIDE: usize = 6;
const LEAST_RANGE: f64 = 3.0;
/// Shortest rest of the voltage in which a spring without noise may come to rest, in rows, and fewest rests that show that it does not.
const REST: usize = 10;
const FEWEST_RESTS: usize = 2;
/// Fewest places elsewhere that show how the readings move, and most that are looked at.
const FEWEST_PLACES: usize = 5;
const MOST_PLACES: usize = 10_000;
/// Largest ratio of the sums of the voltage's changes at places that are alike.
const ALIKE: f64 = 2.0;

/// Readings of a record with what is typical of those that are not equal to their neighbours.
struct Readings {
    value: Vec<f64>,
    voltage: Vec<f64>,
    /// Largest difference of equal readings.
    rounding: f64,
    /// Smallest change of the voltage that counts, in V.
    change_v: f64,
    /// True for a reading that belongs to no run of [`FEWEST_TIES`] or more, and to no dropout.
    free: Vec<bool>,
    /// Smallest change from one free reading to the next that is not 0, median and largest one.
    smallest: f64,
    typical: f64,
    largest: f64,
    /// True if most of the rests of the voltage, and at least two, end with free readings: without noise, a spring comes to rest in them.
    noisy_rests: bool,
}

/// Returns the places of the readings, each a row, a time in s and a value, that are not those of a stuck sensor; `None` if it was not
/// stuck. The reading that is repeated is a good one, unless the readings jump to it.
pub(super) fn stuck(record: &Record, rows: &[(usize, f64, f64)]) -> Option<Vec<usize>> {
    let value: Vec<f64> = rows.iter().map(|(_, _, value)| *value).collect();
    let voltage: Vec<f64> = rows.iter().map(|(row, _, _)| record.rows[*row].voltage_v).collect();
    let [low, high] = range(&value);
    let rounding = ROUNDING * (high - low);
    let runs = runs(value.len(), |row| (value[row] - value[row - 1]).abs() <= rounding);
    let dropped = dropouts(&value, &voltage, &runs, rounding);
    // Shorter runs of other values prove nothing, and most records have no other.
    if dropped.is_empty() && runs.iter().all(|run| run.len() < FEWEST_TIES.count()) {
        return None;
    }
    let (short, runs): (Vec<_>, Vec<_>) = runs.into_iter().partition(|run| dropped.contains(run));
    let tied = runs.iter().filter(|run| run.len() >= FEWEST_TIES.count()).chain(&short);
    let readings = Readings::of(value, voltage, rounding, tied)?;
    // The first readings may be those of a spring at rest in a simulation.
    let Bounds { upper, lower } = Bounds::of_file(&readings.value);
    let special = [Some(low), Some(high), Some(0.0), upper, lower];
    let special: Vec<(f64, usize)> =
        special.into_iter().flatten().map(|value| (value, readings.begins(value))).collect();
    let is_special = |run: &Range<usize>| special.iter().any(|(value, _)| readings.equal(run.start, *value));
    // With noise, a bound is reached again and again.
    let is_bound = |run: &Range<usize>| {
        special.iter().any(|(value, begins)| *begins >= FEWEST_TIES.count() && readings.equal(run.start, *value))
    };
    let (jumped, others): (Vec<_>, Vec<_>) = runs
        .into_iter()
        .filter(|run| run.start > 0)
        .partition(|run| run.len() >= FEWEST_TIES.count() && readings.jump(run));
    // Of a contact that is loose, so are shorter losses and those next to a step of the voltage.
    let is_same = |run: &Range<usize>| jumped.iter().any(|of| readings.equal(run.start, readings.value[of.start]));
    let (lost, others): (Vec<_>, Vec<_>) =
        others.into_iter().partition(|run| is_same(run) && readings.jumps_and_returns(run));
    let others: Vec<Range<usize>> = others.into_iter().filter(|run| !is_bound(run)).collect();
    let shortest = shortest_stuck(&others).unwrap_or(usize::MAX);
    let long: Vec<Range<usize>> = others.into_iter().filter(|run| run.len() >= shortest).collect();
    let have_noise = readings.have_noise();
    let is_proved = |run: &Range<usize>| {
        let by_noise =
            || readings.is_among_noise(run, shortest) || readings.catches_up_at_rest(run) || readings.stays_behind(run);
        have_noise && by_noise() || readings.stops_in_a_movement(run)
    };
    let is_proved = |run: &Range<usize>| {
        if is_special(run) { have_noise && readings.leaves_with_a_jump(run) } else { is_proved(run) }
    };
    let sticks = long.iter().any(is_proved);
    let repeated = long.into_iter().filter(|_| sticks).map(|run| run.start + 1..run.end);
    let faulty: Vec<Range<usize>> =
        dropped.into_iter().chain(jumped.iter().cloned()).chain(lost).chain(repeated).collect();
    let mut is_faulty = vec![false; rows.len()];
    faulty.iter().for_each(|run| is_faulty[run.clone()].fill(true));
    (!faulty.is_empty()).then(|| (0..rows.len()).filter(|&row| !is_faulty[row]).collect())
}

impl Readings {
    /// Of all readings, those in `tied` ranges not being free; `None` if too few of them are free to say how the others behave.
    fn of<'r>(
        value: Vec<f64>,
        voltage: Vec<f64>,
        rounding: f64,
        tied: impl Iterator<Item = &'r Range<usize>>,
    ) -> Option<Self> {
        let mut free = vec![true; value.len()];
        tied.for_each(|run| free[run.clone()].fill(false));
        let neighbours = (1..value.len()).filter(|&row| free[row - 1] && free[row]);
        let mut changes: Vec<f64> = neighbours.map(|row| (value[row] - value[row - 1]).abs()).collect();
        if changes.len() < FEWEST_NEW.max(value.len() / 2) {
            return None;
        }
        let largest = changes.iter().copied().fold(0.0, f64::max);
        let smallest = changes.iter().copied().filter(|change| *change > rounding).fold(f64::INFINITY, f64::min);
        let typical = median(&mut changes)?;
        let rests = self::runs(voltage.len(), |row| voltage[row] == voltage[row - 1]);
        let ends = rests.iter().filter(|rest| rest.len() >= REST).map(|rest| free[rest.end - 1]);
        let (noisy, quiet): (Vec<bool>, Vec<bool>) = ends.partition(|free| *free);
        let noisy_rests = noisy.len() >= FEWEST_RESTS && noisy.len() > quiet.len();
        Some(Self {
            change_v: smallest_change(&voltage),
            value,
            voltage,
            rounding,
            free,
            smallest,
            typical,
            largest,
            noisy_rests,
        })
    }

    fn equal(&self, row: usize, value: f64) -> bool {
        (self.value[row] - value).abs() <= self.rounding
    }

    fn change(&self, row: usize) -> f64 {
        self.value[row] - self.value[row - 1]
    }

    /// True if the reading turns back: the last two changes have opposite signs.
    fn turns(&self, row: usize) -> bool {
        self.change(row) * self.change(row - 1) < 0.0
    }

    /// True if all of some rows are free, of those that exist.
    fn are_free(&self, rows: Range<usize>) -> bool {
        self.free[rows.start..rows.end.min(self.free.len())].iter().all(|free| *free)
    }

    /// True if at least half of some rows are free.
    fn are_mostly_free(&self, rows: &Range<usize>) -> bool {
        2 * self.free[rows.clone()].iter().filter(|free| **free).count() >= rows.len()
    }

    /// Number of runs with a value.
    fn begins(&self, value: f64) -> usize {
        (1..self.value.len()).filter(|&row| self.equal(row, value) && !self.equal(row - 1, value)).count()
    }

    /// True if the voltage rests in some rows, of those that exist.
    fn rests(&self, rows: Range<usize>) -> bool {
        rests(&self.voltage, self.change_v, rows)
    }

    /// True if noise shows: readings turn back under a voltage that rests, or often if it never does.
    fn have_noise(&self) -> bool {
        let triples = (2..self.value.len()).filter(|&row| self.are_free(row - 2..row + 1));
        let rests = |row: &usize| self.voltage[row - 2..=*row].iter().all(|volts| *volts == self.voltage[*row]);
        let (at_rest, others): (Vec<usize>, Vec<usize>) = triples.partition(rests);
        let (rows, least) = if at_rest.len() < FEWEST_NEW { (others, TURNING) } else { (at_rest, NOISY) };
        let turns = rows.iter().filter(|&&row| self.turns(row)).count();
        turns as f64 > least * rows.len() as f64
    }

    /// True if the readings jump to the run and back from it, by more than they change elsewhere, while the voltage rests, and not from or
    /// to a single one, which is an outlier in a longer run.
    fn jump(&self, run: &Range<usize>) -> bool {
        let jumps = |row: usize| {
            self.change(row).abs() > self.largest && self.rests(row.saturating_sub(MARGIN)..row + MARGIN + 1)
        };
        jumps(run.start)
            && self.are_free(run.start.saturating_sub(2)..run.start)
            && (run.end == self.value.len() || jumps(run.end) && self.are_free(run.end..run.end + 2))
    }

    /// True if the readings jump to the run and back from it.
    fn jumps_and_returns(&self, run: &Range<usize>) -> bool {
        let jumps = |row: usize| self.change(row).abs() > MOVES * self.typical;
        jumps(run.start) && (run.end == self.value.len() || jumps(run.end))
    }

    /// True if there is noise before the run and after it, under the same voltage; if this changes before the end of the run, but after
    /// the shortest of a stuck sensor, noise in other rests of the voltage stands for that after it.
    fn is_among_noise(&self, run: &Range<usize>, shortest: usize) -> bool {
        let before = run.start.saturating_sub(BESIDE)..run.start;
        let after = run.end..(run.end + BESIDE).min(self.value.len());
        let has_noise = |rows: &Range<usize>| {
            rows.len() == BESIDE
                && self.are_mostly_free(rows)
                && (rows.start + 2..rows.end).any(|row| self.turns(row))
                && self.moves(rows.clone())
        };
        let is_followed = if after.is_empty() || !self.rests(run.start..run.end + 1) {
            self.noisy_rests && self.rests(before.start..run.start + shortest)
        } else {
            self.rests(before.start..after.end) && has_noise(&after)
        };
        has_noise(&before) && is_followed
    }

    /// True if the range of the readings in some rows is more than they typically change in one, and than a coarse one has at rest.
    fn moves(&self, rows: Range<usize>) -> bool {
        let [low, high] = range(&self.value[rows]);
        high - low > self.typical.max(LEAST_RANGE * self.smallest)
    }

    /// True if the run ends with a jump of more than `least`, and not with an outlier.
    fn catches_up(&self, run: &Range<usize>, least: f64) -> bool {
        let after = run.end + 1..(run.end + 1 + AFTER).min(self.value.len());
        let away = self.typical.min(least);
        run.end < self.value.len()
            && self.change(run.end).abs() > least
            && after.into_iter().all(|row| (self.value[row] - self.value[run.start]).abs() > away)
    }

    /// True if the readings come to the run by no more than they change elsewhere, and jump from it by more, while the voltage rests: those
    /// of a bound leave it by less than the response moves, and a shift that takes them to a bound makes a jump there as well.
    fn leaves_with_a_jump(&self, run: &Range<usize>) -> bool {
        run.start > 0
            && self.change(run.start).abs() <= self.largest
            && self.catches_up(run, self.largest)
            && self.rests_at_the_end(run)
    }

    /// True if the voltage rests around the end of the run.
    fn rests_at_the_end(&self, run: &Range<usize>) -> bool {
        self.rests(run.end - MARGIN..run.end + MARGIN + 1)
    }

    /// Median change from row to row among the free readings beside the run, and at least what a coarse reading changes by; the median of
    /// all if there are too few.
    fn typical_beside(&self, run: &Range<usize>) -> f64 {
        let beside = run.len().max(BESIDE);
        let before = run.start.saturating_sub(beside).max(1)..run.start;
        let after = (run.end + 2)..(run.end + 2 + beside).min(self.value.len());
        let free = |row: &usize| self.free[row - 1] && self.free[*row];
        let mut changes: Vec<f64> = before.chain(after).filter(free).map(|row| self.change(row).abs()).collect();
        let least = LEAST_RANGE * self.smallest;
        let typical = if changes.len() < BESIDE { None } else { median(&mut changes) };
        typical.map_or(self.typical, |typical| typical.max(least))
    }

    /// True if the readings move right before the run.
    fn stops(&self, run: &Range<usize>) -> bool {
        run.start >= BESIDE && self.moves(run.start - BESIDE..run.start)
    }

    /// True if the run ends with a jump after the voltage has rested for half of it, or, if it began in the middle of a movement, while
    /// the voltage rests.
    fn catches_up_at_rest(&self, run: &Range<usize>) -> bool {
        let half = run.start + run.len() / 2;
        self.catches_up(run, MOVES * self.typical.min(self.typical_beside(run)))
            && (self.rests(half..run.end + 1) || self.stops(run) && self.rests_at_the_end(run))
    }

    /// True if the voltage changes in the first half of the run, and the readings elsewhere move in as many rows after such a change.
    fn stays_behind(&self, run: &Range<usize>) -> bool {
        let differs = |from: usize, to: usize| (self.voltage[to] - self.voltage[from]).abs() > self.change_v;
        let Some(changed) = (run.start..run.start + run.len() / 2).find(|&row| differs(run.start, row)) else {
            return false;
        };
        // Until the next change: the one after may take the response back.
        let rows = (changed..run.end).take_while(|&row| !differs(changed, row)).count() - 1;
        let places = self.places(rows).filter(|&row| self.free[row - 1] && self.free[row + rows]);
        let after_change = places.filter(|&row| differs(row - 1, row + rows));
        let mut moved: Vec<f64> =
            after_change.map(|row| (self.value[row + rows] - self.value[row - 1]).abs()).collect();
        moved.len() >= FEWEST_PLACES && median(&mut moved).is_some_and(|moved| moved > MOVES * self.typical)
    }

    /// True if the readings move right before the run and right after it, or jump at its end by more than they change elsewhere, and the
    /// voltage changes in its first half and by as much as in places elsewhere, in the same range, where the readings move: a spring that
    /// comes to rest, at a bound, in a dead zone or within a step of the sensor, slows down before, or stays there as well.
    fn stops_in_a_movement(&self, run: &Range<usize>) -> bool {
        let after = run.end..(run.end + BESIDE).min(self.value.len());
        let goes_on = || after.len() < 2 || self.moves(after.clone());
        let is_abrupt = self.stops(run) && goes_on() || self.catches_up(run, self.largest);
        let changes = |start: usize| !self.rests(start..start + run.len() / 2);
        if !is_abrupt || !changes(run.start) {
            return false;
        }
        let [low, high] = range(&self.voltage[run.clone()]);
        let voltages = low - self.change_v..=high + self.change_v;
        let swept = self.swept(run);
        let is_alike = |rows: &Range<usize>| {
            (rows.end <= run.start || rows.start >= run.end)
                && changes(rows.start)
                && self.voltage[rows.clone()].iter().all(|volts| voltages.contains(volts))
                && (swept / ALIKE..=swept * ALIKE).contains(&self.swept(rows))
                && self.are_mostly_free(rows)
        };
        self.places(run.len()).map(|start| start..start + run.len()).filter(is_alike).nth(FEWEST_PLACES - 1).is_some()
    }

    /// First rows of places elsewhere, with so many rows after them.
    fn places(&self, rows: usize) -> impl Iterator<Item = usize> + use<> {
        (1..self.value.len().saturating_sub(rows)).step_by(self.value.len().div_ceil(MOST_PLACES))
    }

    /// Sum of the voltage's changes in some rows, in V.
    fn swept(&self, rows: &Range<usize>) -> f64 {
        self.voltage[rows.clone()].windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum()
    }
}

/// Returns the smallest and the largest of some values.
pub(super) fn range(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &value| [low.min(value), high.max(value)])
}

/// Returns the smallest change of a voltage that counts, in V.
fn smallest_change(voltage: &[f64]) -> f64 {
    let [low, high] = range(voltage);
    CHANGE * (high - low)
}

/// True if a voltage changes by no more than `change_v` in some rows, of those that exist.
fn rests(voltage: &[f64], change_v: f64, rows: Range<usize>) -> bool {
    let [low, high] = range(&voltage[rows.start..rows.end.min(voltage.len())]);
    high - low <= change_v
}

/// Returns the ranges of rows that `continues` says to belong to the row before.
fn runs(rows: usize, continues: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let starts: Vec<usize> = (0..rows).filter(|&row| row == 0 || !continues(row)).collect();
    let ends = starts.iter().skip(1).copied().chain([rows]);
    starts.iter().zip(ends).map(|(&start, end)| start..end).collect()
}

/// Returns the runs of the lowest or the highest reading, short ones as well, if the readings jump to each and back from it by more than
/// they change anywhere else, and at least [`FEWEST_TIES`] of them have two rows or more while the voltage rests: those of a contact that is
/// lost for a few rows. The code of single failed readings makes outliers.
fn dropouts(value: &[f64], voltage: &[f64], runs: &[Range<usize>], rounding: f64) -> Vec<Range<usize>> {
    let [low, high] = range(value);
    let change_v = smallest_change(voltage);
    let rests = |run: &&Range<usize>| rests(voltage, change_v, run.start.saturating_sub(MARGIN)..run.end + MARGIN);
    let change = |row: &usize| (value[*row] - value[row - 1]).abs();
    let at = |extreme: f64| -> Vec<Range<usize>> {
        runs.iter().filter(|run| (value[run.start] - extreme).abs() <= rounding).cloned().collect()
    };
    let are_jumps = |of: &Vec<Range<usize>>| {
        let ends: Vec<usize> =
            of.iter().flat_map(|run| [run.start, run.end]).filter(|row| (1..value.len()).contains(row)).collect();
        let smallest = ends.iter().map(change).fold(f64::INFINITY, f64::min);
        let others = (1..value.len()).filter(|row| ends.binary_search(row).is_err());
        of.iter().filter(rests).filter(|run| run.len() > 1).count() >= FEWEST_TIES.count()
            && smallest > others.map(|row| change(&row)).fold(0.0, f64::max)
    };
    [low, high].map(at).into_iter().find(are_jumps).unwrap_or_default()
}

/// Returns the least length of the runs of a stuck sensor, all others being far shorter and fewer than would make one by chance.
fn shortest_stuck(runs: &[Range<usize>]) -> Option<usize> {
    let mut lengths: Vec<usize> = runs.iter().map(Range::len).collect();
    lengths.sort_unstable();
    let rows = lengths.iter().sum::<usize>() as f64;
    let (mut longest, mut repeats) = (0, 0);
    for length in lengths {
        let part = repeats.max(1) as f64 / rows;
        let by_chance = 1.0 + (BY_CHANCE / rows).ln() / part.ln();
        let least = SHORTEST_RUN.get().max(longest as f64 / OTHERS).max(by_chance).ceil() as usize;
        if part < MOST_REPEATED.get() && length >= least {
            return Some(least);
        }
        (longest, repeats) = (length, repeats + length - 1);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::held::{Held, Reason, held};
    use crate::stats::scale::normals;
    use random_numbers::Lcg32;
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
    fn all_losses_of_a_loose_contact_are_faults() {
        let runs = [[450, 470], [752, 755], [903, 904], [998, 1006], [1350, 1362]];
        let stuck = stuck_in(&held_in(noisy(), &runs, Some(-600.0))).unwrap();
        assert_eq!(stuck.rows, rows_of(&runs));
        // Readings that pass the value in a movement are good ones.
        let mut record = noisy();
        let between = 0.5 * (record.rows[611].measured.unwrap() + record.rows[613].measured.unwrap());
        record.rows[612].measured = Some(between);
        let held = held_in(record, &[[450, 470]], Some(between));
        assert_eq!(stuck_in(&held).map(|stuck| stuck.rows), Some(rows_of(&[[450, 470]])));
    }

    #[test]
    fn a_contact_that_is_lost_for_two_rows_again_and_again_is_loose() {
        let runs = [[450, 452], [752, 754], [905, 906], [1350, 1352]];
        let stuck = stuck_in(&held_in(noisy(), &runs, Some(-600.0))).unwrap();
        assert_eq!(stuck.rows, rows_of(&runs));
        // Twice is chance, single rows are outliers, and a pulse of the voltage is no fault.
        assert_eq!(stuck_in(&held_in(noisy(), &runs[..2], Some(-600.0))), None);
        assert_eq!(stuck_in(&held_in(noisy(), &runs.map(|[from, _]| [from, from + 1]), Some(-600.0))), None);
        let mut pulses = held_in(noisy(), &runs, Some(-600.0));
        runs.iter().for_each(|&[from, to]| pulses.rows[from..to].iter_mut().for_each(|row| row.voltage_v = -600.0));
        assert_eq!(stuck_in(&pulses), None);
    }

    #[test]
    fn a_sensor_that_sticks_at_its_highest_reading_as_well_has_no_bound() {
        let mut record = noisy();
        record.rows[559].measured = Some(204.0);
        let runs = [[300, 330], [560, 600]];
        let stuck = stuck_in(&held_in(record, &runs, None)).unwrap();
        assert_eq!(stuck.rows, rows_of(&runs));
    }

    /// A slow triangle of the voltage, between fast ones; noise of 1 V.
    fn triangles() -> Record {
        let mut state = 0.0;
        let rows = normals(ROWS).into_iter().enumerate().map(|(row, noise)| {
            let (at, period) = if (600..1400).contains(&row) { (row - 600, 800) } else { (row % 100, 100) };
            let voltage_v = at.min(period - at) as f64 * 200.0 / period as f64;
            state += (voltage_v - state) / 3.0;
            Row { line: row, time_s: 0.1 * row as f64, voltage_v, measured: Some(state + noise) }
        });
        Record { name: String::new(), rows: rows.collect() }
    }

    #[test]
    fn a_short_stop_in_a_slow_movement_is_compared_with_the_readings_beside_it() {
        assert_eq!(stuck_in(&triangles()), None);
        for runs in [[[700, 724]], [[1103, 1127]]] {
            assert_eq!(stuck_in(&held_in(triangles(), &runs, None)).map(|stuck| stuck.rows), Some(rows_of(&runs)));
        }
    }

    #[test]
    fn a_single_run_at_the_highest_reading_that_ends_with_a_jump_is_no_bound() {
        let record = triangles();
        let by_reading = |a: &&Row, b: &&Row| a.measured.partial_cmp(&b.measured).unwrap();
        let highest = record.rows.iter().max_by(by_reading).unwrap().line;
        let runs = [[highest + 1, highest + 41]];
        assert_eq!(stuck_in(&held_in(record, &runs, None)).map(|stuck| stuck.rows), Some(rows_of(&runs)));
    }

    /// Steps of 12 rows that never let a lightly damped spring rest, and one long rest, read in steps of 0.5 V; with noise of the readings
    /// and of the voltage that the file has, in V.
    fn paused(noise_v: f64, noise_of_voltage_v: f64) -> Record {
        let (mut at, mut speed, mut drawn, mut numbers) = (0.0, 0.0, 1, Lcg32::new(1));
        let rows = normals(ROWS).into_iter().enumerate().map(|(row, noise)| {
            if row % 12 == 0 {
                drawn = numbers.draw();
            }
            let volts = if (900..1400).contains(&row) { 40.0 } else { f64::from(drawn >> 24) };
            speed += 0.4 * (volts - at) - 0.25 * speed;
            at += speed;
            let measured = Some(((at + noise_v * noise) / 0.5).round() * 0.5);
            let voltage_v = volts + noise_of_voltage_v * (noise * 1e3).sin();
            Row { line: row, time_s: 0.1 * row as f64, voltage_v, measured }
        });
        Record { name: String::new(), rows: rows.collect() }
    }

    /// One pulse that takes a fast spring beyond the sensor's bound, and no other reading near it.
    fn pulse() -> Record {
        let mut record = record(|_| 0.3);
        for (row, of) in record.rows.iter_mut().enumerate().filter(|(row, _)| (700..760).contains(row)) {
            (of.voltage_v, of.measured) = (900.0, Some(if row < 702 { 400.0 } else { 500.0 }));
        }
        record
    }

    /// The plateau of a bound that is reached once, with outliers in it.
    fn plateau_with_outliers() -> Record {
        let mut record = record(|_| 0.3);
        record.rows.truncate(1000);
        record.rows.iter_mut().for_each(|row| row.measured = row.measured.map(|reading| reading.min(150.0)));
        [450, 470, 540, 599].into_iter().for_each(|row: usize| record.rows[row].measured = Some(-60.0));
        record
    }

    /// A chirp of up to 100 V whose voltage passes `by` before a lag of 8 rows, with noise, in V; readings in steps.
    fn swept(noise_v: f64, step: f64, by: impl Fn(f64) -> f64) -> Record {
        let mut state = 0.0;
        let rows = normals(ROWS).into_iter().enumerate().map(|(row, noise)| {
            let at = row as f64 / ROWS as f64;
            let voltage_v = 50.0 * (1.0 - (60.0 * at + 150.0 * at * at).cos());
            state += (by(voltage_v) - state) / 8.0;
            let measured = Some(((state + noise_v * noise) / step).round() * step);
            Row { line: row, time_s: 0.1 * row as f64, voltage_v, measured }
        });
        Record { name: String::new(), rows: rows.collect() }
    }

    #[test]
    fn a_sensor_may_stick_while_the_voltage_keeps_changing() {
        for (noise_v, step) in [(0.0, 1e-6), (0.05, 1e-6), (0.05, 0.02), (1.0, 0.4)] {
            for runs in [[[701, 750]], [[1210, 1235]], [[1500, 1700]]] {
                let stuck = stuck_in(&held_in(swept(noise_v, step, |volts| volts), &runs, None)).unwrap();
                // On a coarse grid a good reading may equal the last of the run.
                let [[from, to]] = runs;
                let is_run = stuck.rows.iter().all(|row| (from - 2..to + 2).contains(row));
                assert!(is_run && stuck.rows.len() >= to - from, "{noise_v} {step} {runs:?}: {:?}", stuck.rows);
            }
        }
    }

    /// The voltage changes after most of a run that began at rest; readings before it are equal by chance.
    #[test]
    fn a_sensor_may_stick_over_a_change_of_the_voltage() {
        let mut record = noisy();
        (718..721).for_each(|row| record.rows[row].measured = record.rows[717].measured);
        let held = held_in(record, &[[726, 830]], None);
        assert_eq!(stuck_in(&held).unwrap().rows, rows_of(&[[726, 830]]));
    }

    #[test]
    fn a_good_sensor_of_a_spring_that_is_swept_is_not_stuck() {
        let laws: [fn(f64) -> f64; 4] = [
            |volts| volts,
            |volts| volts.min(60.0),
            |volts| (volts - 60.0).max(0.0),
            |volts| if volts < 40.0 { volts } else { 40.0 + (volts - 60.0).max(0.0) },
        ];
        for law in laws {
            for noise_v in [0.0, 0.05, 1.0] {
                for step in [1e-9, 1e-3, 0.1, 1.0, 5.0, 20.0] {
                    let record = swept(noise_v, step, law);
                    let is_stuck = held(&record).is_some_and(|held| held.reason == Reason::Stuck);
                    assert!(!is_stuck, "{noise_v} {step} {}", law(50.0));
                }
            }
        }
    }

    /// Two steps of the voltage: the reading stops while the first response still rises, and jumps some time after the second step.
    #[test]
    fn a_sensor_may_stick_in_a_response_until_after_the_next_step() {
        let mut record = noisy();
        record.rows.truncate(480);
        let held = held_in(record, &[[225, 420]], None);
        assert_eq!(stuck_in(&held).unwrap().rows, rows_of(&[[225, 420]]));
    }

    #[test]
    fn a_sensor_that_stops_before_the_end_was_stuck() {
        for runs in [[[1700, 2000]], [[1400, 2000]]] {
            assert_eq!(stuck_in(&held_in(noisy(), &runs, None)).unwrap().rows, rows_of(&runs));
        }
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
        records.extend([paused(0.0, 0.0), paused(0.02, 0.0), paused(0.02, 0.5), pulse(), plateau_with_outliers()]);
        for (index, record) in records.iter().enumerate() {
            assert_eq!(held(record), None, "{index}");
        }
    }
}
