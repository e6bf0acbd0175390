//! The bounds of the sensor, at which readings accumulate.
//!
//! Continuous noise does not give the same number twice. Readings that are exactly the highest or the lowest more often than noise,
//! rounding or a spring at rest repeat any other one therefore stopped there. A few single readings may lie beyond a bound, those that the
//! link after the sensor spoils, if the readings stop at the bound far more often, and again and again.

use crate::record::quantisation_grid::QuantisationGrid;
use crate::stats::median::robust_deviation;
use crate::stats::scale::second_differences;
use crate::stats::thresholds::empirical::{BOUND_TO_NEXT_STEP, CLOSE_TO_BOUND, COARSE, FEWEST_TIES};

/// Fewest distinct readings from which a grid can be found.
const FEWEST_ON_GRID: usize = 6;

/// Largest number of readings beyond a bound, relative to those at it.
const BEYOND: f64 = 0.1;
/// Largest part of those that follow another one.
const TOGETHER: f64 = 0.1;

/// The bounds at which readings stopped, in the unit of the readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// The upper bound; `None` if no reading stopped above.
    pub upper: Option<f64>,
    /// The lower bound; `None` if no reading stopped below.
    pub lower: Option<f64>,
}

/// The different readings of a record in ascending order, each with its number of rows.
pub struct Distinct(Vec<(f64, usize)>);

impl Distinct {
    /// Returns the different ones of some readings.
    pub fn of(readings: &[f64]) -> Self {
        let mut sorted = readings.to_vec();
        sorted.sort_by(f64::total_cmp);
        let mut counts: Vec<(f64, usize)> = Vec::new();
        for value in sorted {
            match counts.last_mut() {
                Some((last, count)) if *last == value => *count += 1,
                _ => counts.push((value, 1)),
            }
        }
        Self(counts)
    }

    /// Returns the readings between the extremes, from which a grid can be found; `None` if there are too few.
    pub fn between_extremes(&self) -> Option<Vec<f64>> {
        let counts = &self.0;
        let inner = || counts[1..counts.len() - 1].iter().map(|&(value, _)| value).collect();
        (counts.len() >= FEWEST_ON_GRID).then(inner)
    }
}

impl Bounds {
    /// Returns the bounds of readings as they are in a file.
    pub fn of_file(readings: &[f64]) -> Self {
        let distinct = Distinct::of(readings);
        let grid = distinct.between_extremes().and_then(|values| QuantisationGrid::of(&values));
        Self::of(readings, &distinct, grid.map(|grid| grid.step), scatter(readings))
    }

    /// Returns the bounds of readings on a grid of the given step, if there is one, whose independent noise has the scale `scatter`.
    pub fn of(readings: &[f64], distinct: &Distinct, step: Option<f64>, scatter: f64) -> Self {
        let counts = &distinct.0;
        if readings.first() == readings.last() && counts.len() <= 2 {
            return Self::default();
        }
        let ties = counts.iter().filter(|(_, count)| *count > 1).count();
        let continuous = ties <= counts.len() / 50 + 2;
        // The places that may be bounds: each the first reading that is repeated, with nothing but single readings beyond.
        let is_tied = |place: &usize| counts[*place].1 >= FEWEST_TIES.count();
        let lowest = (0..counts.len()).find(is_tied).filter(|&place| are_single(readings, counts[place], f64::lt));
        let highest =
            (0..counts.len()).rev().find(is_tied).filter(|&place| are_single(readings, counts[place], f64::gt));
        let last = counts.len().saturating_sub(1);
        let inner = counts.iter().take(highest.unwrap_or(last)).skip(lowest.unwrap_or(0) + 1);
        let most_repeated = inner.clone().map(|(_, count)| *count).max().unwrap_or(1);
        // A sensor that hangs repeats one; a running median or a sensor that is read too often repeats many.
        let stands_out =
            |count: usize| inner.clone().filter(|(value, times)| *value != 0.0 && *times >= count).count() <= 1;
        let far = CLOSE_TO_BOUND.get() * scatter;
        let is_fine = step.is_some_and(|step| step < COARSE.get() * scatter);
        let bound = |place: Option<usize>, next: Option<usize>| {
            let (value, count) = counts[place?];
            // On a fine grid the next step is a fair judge. On a coarse one every level at which the spring settles repeats one reading,
            // and without one any reading may often be the same.
            let compared =
                if is_fine { next.and_then(|next| counts.get(next)).map_or(1, |next| next.1) } else { most_repeated };
            let piled = continuous && stands_out(count) || count >= BOUND_TO_NEXT_STEP.count() * compared;
            // A spring at rest reads exactly zero many times.
            (piled && count < readings.len() && value != 0.0 && stays(readings, value, far)).then_some(value)
        };
        Self {
            upper: bound(highest, highest.and_then(|place| place.checked_sub(1))),
            lower: bound(lowest, lowest.map(|place| place + 1)),
        }
    }

    /// Returns true for a reading at a bound or beyond it, which says nothing of the response.
    pub fn stopped(&self, reading: f64) -> bool {
        self.upper.is_some_and(|bound| reading >= bound) || self.lower.is_some_and(|bound| reading <= bound)
    }
}

/// Returns the scale of independent noise of some readings; 0 if most of them repeat, infinite if they are too few.
pub fn scatter(readings: &[f64]) -> f64 {
    robust_deviation(second_differences(readings)).unwrap_or(f64::INFINITY)
}

/// Returns true if at least half of the readings with this value have a neighbour within `far`; isolated error codes have none.
fn stays(reading: &[f64], value: f64, far: f64) -> bool {
    let near = |row: Option<&f64>| row.is_some_and(|other| (other - value).abs() <= far);
    let rows = || (0..reading.len()).filter(|&row| reading[row] == value);
    let staying = rows().filter(|&row| near(reading.get(row + 1)) || near(reading.get(row.wrapping_sub(1)))).count();
    2 * staying >= rows().count()
}

/// Returns true if no reading is beyond a value, which `count` readings have, or few single ones between those, which return to it.
fn are_single(readings: &[f64], (value, count): (f64, usize), is_beyond: fn(&f64, &f64) -> bool) -> bool {
    let beyond: Vec<usize> = (0..readings.len()).filter(|&row| is_beyond(&readings[row], &value)).collect();
    let together = beyond.windows(2).filter(|pair| pair[1] == pair[0] + 1).count();
    let begins = readings.windows(2).filter(|pair| pair[1] == value && pair[0] != value).count();
    let are_few = beyond.len() as f64 <= BEYOND * count as f64 && together as f64 <= TOGETHER * beyond.len() as f64;
    beyond.is_empty() || are_few && begins >= FEWEST_TIES.count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    /// Bounds of readings of a stair of 0 to 400 V in 1200 rows with noise of 1 V, as a sensor takes them.
    fn bounds(seed: usize, sensor: impl Fn(Vec<f64>) -> Vec<f64>) -> Bounds {
        let volts = |row: usize| 100.0 * (row / 120 % 5) as f64;
        let noise = &normals(1200 * (seed + 1))[1200 * seed..];
        Bounds::of_file(&sensor((0..1200).map(|row| volts(row) + noise[row]).collect()))
    }

    fn upper(seed: usize, sensor: impl Fn(Vec<f64>) -> Vec<f64>) -> Option<f64> {
        bounds(seed, sensor).upper
    }

    #[test]
    fn readings_that_accumulate_at_the_extreme_alone_are_a_bound() {
        let stopped = |read: Vec<f64>| read.into_iter().map(|reading| reading.min(350.0)).collect();
        assert_eq!(upper(0, stopped), Some(350.0));
        assert_eq!(upper(0, |read| read), None);
        // A median of some readings is often the same reading as the one before, at the extreme as well.
        let median = |length: usize, read: Vec<f64>| {
            let of = |rows: &[f64]| {
                let mut rows = rows.to_vec();
                rows.sort_by(f64::total_cmp);
                rows[rows.len() / 2]
            };
            (0..read.len()).map(|row| of(&read[(row + 1).saturating_sub(length)..=row])).collect::<Vec<_>>()
        };
        for (seed, length) in (0..20).flat_map(|seed| [9, 17, 25].map(|length| (seed, length))) {
            assert_eq!(upper(seed, |read| median(length, read)), None, "{seed}, {length}");
        }
        assert_eq!(upper(0, |read| stopped(median(15, read))), Some(350.0));
        // Of a voltage that rises and falls few are: those around its turning points.
        let triangle = |row: usize| 2.0 * (row as i64 % 200 - 100).unsigned_abs() as f64;
        for (seed, length) in (0..20).flat_map(|seed| [5, 9, 17].map(|length| (seed, length))) {
            let noise = &normals(1200 * (seed + 1))[1200 * seed..];
            let read = (0..1200).map(|row| triangle(row) + noise[row]).collect();
            assert_eq!(Bounds::of_file(&median(length, read)), Bounds::default(), "{seed}, {length}");
        }
        // A counter of periods has steps that grow with the reading, and two codes for the highest level, one of them seldom.
        let counted =
            |read: Vec<f64>| read.into_iter().map(|y| 30_199.0 / (30_199.0 / (y + 200.0)).round() - 200.0).collect();
        assert_eq!(upper(0, counted), None);
    }

    /// Outliers that come behind the sensor, in the link.
    #[test]
    fn single_readings_may_be_beyond_a_bound() {
        let spoilt = |every: usize, length: usize| {
            move |read: Vec<f64>| {
                let stopped = read.into_iter().map(|reading| reading.min(350.0));
                let is_spoilt = move |row: usize| row % every < length;
                stopped
                    .enumerate()
                    .map(|(row, y)| if is_spoilt(row) { y + 10.0 + row as f64 / 100.0 } else { y })
                    .collect()
            }
        };
        let both_ways = |read: Vec<f64>| {
            let sign = |row: usize| if row.is_multiple_of(74) { -1.0 } else { 1.0 };
            let within = read.into_iter().map(|reading| reading.clamp(50.0, 350.0)).enumerate();
            within
                .map(|(row, y)| if row.is_multiple_of(37) { y + sign(row) * (60.0 + row as f64 / 100.0) } else { y })
                .collect()
        };
        for seed in 0..20 {
            assert_eq!(bounds(seed, spoilt(37, 1)), Bounds { upper: Some(350.0), lower: None }, "{seed}");
            assert_eq!(bounds(seed, both_ways), Bounds { upper: Some(350.0), lower: Some(50.0) }, "{seed}");
            // In succession they are a response.
            assert_eq!(upper(seed, spoilt(100, 8)), None, "{seed}");
        }
        // A sensor that was stuck once, below its highest readings.
        let stuck = |read: Vec<f64>| {
            (0..read.len()).map(|row| read[if (500..540).contains(&row) { 500 } else { row }]).collect()
        };
        assert_eq!(upper(0, stuck), None);
    }

    /// Rounded to much more than the noise, every level of a stair is one reading: the extremes as well, and no step next to them.
    #[test]
    fn levels_of_a_stair_in_coarse_steps_are_no_bounds() {
        let rounded = |step: f64| move |read: Vec<f64>| read.into_iter().map(|y| (y / step).round() * step).collect();
        for seed in 0..20 {
            assert_eq!(bounds(seed, rounded(12.0)), Bounds::default(), "{seed}");
        }
        // On a fine grid a bound shows.
        let stopped = |read: Vec<f64>| rounded(0.5)(read.into_iter().map(|y| y.min(350.0)).collect());
        assert_eq!(upper(0, stopped), Some(350.0));
    }
}
