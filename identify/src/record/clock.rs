//! The clock of a record's rows: times that are multiples of one interval, but for the rounding with which they were written.
//!
//! A delay or an instantaneous response moves between one row and the next with the least shift of a step against a reading, so that
//! the rounding of times would be taken for a response.

use std::borrow::Cow;

use simulation::record::Record;

/// Largest deviation of times from multiples of their interval, in intervals, that is attributed to their rounding in any case.
const ROUNDING: f64 = 1e-3;
/// Largest range of deviations, in units of the last digit of the times: one, and the error of the interval that is fitted to them.
const MOST_UNITS: f64 = 1.5;
/// Largest deviation of a gap between rows from the two that rounding leaves of equal ones, in units of the last digit.
const SAME_GAP: f64 = 0.01;
/// Largest unit of the last digit that is attributed to rounding, in intervals.
const COARSEST: f64 = 1.0 / 3.0;
/// Largest deviation of a gap from a whole number of these units.
const WHOLE: f64 = 0.1;
/// Deviation of times from those of their clock, in intervals, up to which they are exact.
const EXACT: f64 = 1e-9;

/// Times as multiples of an interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// The interval, in the unit of the times.
    pub interval: f64,
    /// Number of intervals of each time after the first one.
    pub ticks: Vec<f64>,
    /// Time of tick 0.
    start: f64,
    /// Largest range of the deviations that is attributed to rounding.
    tolerated: f64,
}

impl Clock {
    /// Returns the clock of increasing times; `None` if they are not multiples of one interval. Multiples that are left out, as for rows
    /// that were lost, do not matter.
    pub fn of(times: &[f64]) -> Option<Self> {
        let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // The median would be no single interval where many rows were lost.
        let typical = lower_quartile(&gaps).filter(|gap| *gap > 0.0)?;
        let single: Vec<f64> = gaps.iter().copied().filter(|gap| (gap / typical).round() == 1.0).collect();
        let mean = single.iter().sum::<f64>() / single.len() as f64;
        let counts = || gaps.iter().map(|gap| (gap / mean).round());
        if counts().any(|count| count == 0.0) {
            return None;
        }
        let ticks: Vec<f64> = std::iter::once(0.0)
            .chain(counts().scan(0.0, |tick, count| {
                *tick += count;
                Some(*tick)
            }))
            .collect();
        let [least, most] =
            [single.iter().fold(f64::INFINITY, |a, b| b.min(a)), single.iter().fold(0.0, |a: f64, b| a.max(*b))];
        let unit = most - least;
        let units = least / unit;
        let is_rounded = unit <= COARSEST * mean
            && (unit == 0.0 || (units - units.round()).abs() <= WHOLE)
            && single.iter().all(|gap| (gap - least).min(most - gap) <= SAME_GAP * unit);
        let (sum, square) = sums(&ticks, times);
        let interval = sum / square;
        let tolerated = (2.0 * ROUNDING * interval).max(if is_rounded { MOST_UNITS * unit } else { 0.0 });
        Self { interval, ticks, start: 0.0, tolerated }.with_interval(times, interval)
    }

    /// Returns the clock with another interval and the start that suits the times best; `None` if their deviations are too large then.
    fn with_interval(self, times: &[f64], interval: f64) -> Option<Self> {
        let deviations = times.iter().zip(&self.ticks).map(|(time, tick)| time - interval * tick);
        let (low, high) =
            deviations.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), of| (low.min(of), high.max(of)));
        let clock = Self { interval, start: 0.5 * (low + high), ..self };
        (high - low <= clock.tolerated).then_some(clock)
    }

    /// Returns the times without their rounding.
    pub fn times(&self) -> impl Iterator<Item = f64> {
        self.ticks.iter().map(|tick| self.start + self.interval * tick)
    }
}

/// Returns the number that a quarter of the others do not exceed; `None` of none.
fn lower_quartile(of: &[f64]) -> Option<f64> {
    let mut ordered = of.to_vec();
    let at = (!of.is_empty()).then_some(of.len() / 4)?;
    Some(*ordered.select_nth_unstable_by(at, f64::total_cmp).1)
}

/// Sums of the products of ticks and times and of the squares of the ticks, each less its mean.
fn sums(ticks: &[f64], times: &[f64]) -> (f64, f64) {
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let (tick, time) = (mean(ticks), mean(times));
    let add = |(sum, square): (f64, f64), (at, of): (&f64, &f64)| {
        (sum + (at - tick) * (of - time), square + (at - tick).powi(2))
    };
    ticks.iter().zip(times).fold((0.0, 0.0), add)
}

/// Returns records with the times of their clocks, of one interval where one suits all; times that follow no clock stay.
pub fn with_times_of_clock(records: &[Record]) -> Cow<'_, [Record]> {
    let times = |record: &Record| record.rows.iter().map(|row| row.time_s).collect::<Vec<f64>>();
    let clocks: Vec<Option<Clock>> = records.iter().map(|record| Clock::of(&times(record))).collect();
    let sums =
        records.iter().zip(&clocks).filter_map(|(record, clock)| Some(sums(&clock.as_ref()?.ticks, &times(record))));
    let (sum, square) = sums.fold((0.0, 0.0), |(sum, square), of| (sum + of.0, square + of.1));
    let shared =
        |(record, clock): (&Record, &Option<Clock>)| clock.clone()?.with_interval(&times(record), sum / square);
    let shared: Vec<Option<Clock>> = records.iter().zip(&clocks).map(shared).collect();
    let clocks = if shared.iter().all(Option::is_some) { shared } else { clocks };
    let mut exact = Cow::Borrowed(records);
    for (index, clock) in clocks.iter().enumerate() {
        let Some(clock) = clock else { continue };
        if clock.times().zip(&records[index].rows).any(|(time, row)| (time - row.time_s).abs() > EXACT * clock.interval)
        {
            exact.to_mut()[index].rows.iter_mut().zip(clock.times()).for_each(|(row, time)| row.time_s = time);
        }
    }
    exact
}

#[cfg(test)]
mod tests {
    use simulation::record::Row;

    use super::*;
    use crate::stats::scale::normals;

    /// Times of every row that `keeps`, at 30 per s, rounded to ms.
    fn rounded(keeps: impl Fn(usize) -> bool) -> Vec<f64> {
        (0..900).filter(|row| keeps(*row)).map(|row| (row as f64 / 30.0 * 1e3).round() / 1e3).collect()
    }

    fn record(times: &[f64]) -> Record {
        let row = |&time_s: &f64| Row { line: 0, time_s, voltage_v: 0.0, measured: Some(0.0) };
        Record { name: String::new(), rows: times.iter().map(row).collect() }
    }

    #[test]
    fn rounded_times_are_multiples_of_the_interval_also_where_rows_were_lost() {
        for lost in [0, 7, 4] {
            let keeps = |row: usize| lost == 0 || row % lost != 2;
            let clock = Clock::of(&rounded(keeps)).expect("a clock");
            assert!((clock.interval * 30.0 - 1.0).abs() < 1e-4, "{clock:?}");
            let expected = (0..900).filter(|row| keeps(*row)).map(|row| row as f64);
            assert!(clock.ticks.iter().copied().eq(expected), "{:?}", clock.ticks);
        }
    }

    #[test]
    fn jitter_of_the_rows_is_not_rounding() {
        let jitter = normals(900);
        let of = |size: f64| -> Vec<f64> { (0..900).map(|row| row as f64 + size * jitter[row]).collect() };
        assert!(Clock::of(&of(1e-4)).is_some());
        assert_eq!(Clock::of(&of(0.02)), None);
        // Of two intervals, but without one clock.
        let two: Vec<f64> =
            (0..900).map(|row| row as f64 + if row < 450 { 0.0 } else { 0.1 * (row - 450) as f64 }).collect();
        assert_eq!(Clock::of(&two), None);
        assert_eq!(Clock::of(&[0.0]), None);
        // Levels of 9.5 rows, with rows from the turn of each on: nothing was rounded.
        for (interval, short, count) in [(1.0, 0.5, 9), (0.1, 0.05, 9), (1.0, 0.6, 4), (0.9, 1.1, 1)] {
            let gaps = (0..600).map(|gap| if gap % (count + 1) == count { short } else { interval });
            let times: Vec<f64> = gaps
                .scan(0.0, |time, gap| {
                    *time += gap;
                    Some(*time)
                })
                .collect();
            assert_eq!(Clock::of(&times), None, "{interval} {short}");
        }
    }

    #[test]
    fn records_of_one_clock_get_one_interval_and_exact_times_stay() {
        let rounded = [record(&rounded(|row| row < 400)), record(&rounded(|row| row > 100))];
        let timed = with_times_of_clock(&rounded);
        let [one, other] = [&timed[0], &timed[1]]
            .map(|record| Clock::of(&record.rows.iter().map(|row| row.time_s).collect::<Vec<f64>>()).expect("a clock"));
        assert!((one.interval / other.interval - 1.0).abs() < 1e-12, "{} {}", one.interval, other.interval);
        let exact = [record(&[0.1, 0.2, 0.30000000000000004, 0.5])];
        assert!(matches!(with_times_of_clock(&exact), Cow::Borrowed(_)));
    }
}
