//! The samples of the last minutes, and those of them that a plot shows.

use std::collections::VecDeque;

use link::Telemetry;

/// Longest time that is kept, in s.
pub(super) const LONGEST_S: f64 = 300.0;

/// One sample of the loop, as it is plotted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// Time since the MCU started, in s.
    pub(super) time_s: f64,
    /// Target, in V.
    pub(super) target_v: f64,
    /// Voltage across the spring, in V.
    pub(super) applied_v: f64,
    /// Estimated stiffness, in V.
    pub(super) estimate_v: f64,
    /// Measured stiffness, in V; `None` without a new reading.
    pub(super) measured_v: Option<f64>,
}

/// The samples of the last [`LONGEST_S`] seconds.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    points: VecDeque<Point>,
}

/// A curve as lines: where samples are missing, a line ends and another begins.
pub(super) type Lines = Vec<Vec<(f64, f64)>>;

impl History {
    /// Adds a sample of an MCU with `rate_hz` ticks per second. A sample that is older than the last one is of a restarted MCU:
    /// what came before it is dropped.
    pub(super) fn add(&mut self, sample: &Telemetry, rate_hz: u32) {
        let time_s = sample.tick as f64 / f64::from(rate_hz.max(1));
        if self.points.back().is_some_and(|last| time_s < last.time_s) {
            self.points.clear();
        }
        while self.points.front().is_some_and(|first| time_s - first.time_s > LONGEST_S) {
            self.points.pop_front();
        }
        self.points.push_back(Point {
            time_s,
            target_v: sample.target.to_f64(),
            applied_v: sample.applied.to_f64(),
            estimate_v: sample.estimate.to_f64(),
            measured_v: sample.measured.map(|measured| measured.to_f64()),
        });
    }

    /// A curve over the last `window_s` seconds, at times relative to the newest sample: at most two points, the lowest and the
    /// highest, in each of `columns` intervals, so that no extreme value is lost, and the newest one.
    pub(super) fn curve(&self, window_s: f64, columns: u16, value: impl Fn(&Point) -> Option<f64>) -> Lines {
        let Some(newest) = self.points.back().map(|point| point.time_s) else { return Lines::new() };
        let width_s = window_s / f64::from(columns.max(1));
        // What is shown as one column has no gap.
        let longest_gap_s = (2.0 * width_s).max(0.5);
        let mut lines = Lines::new();
        let mut column = Column::default();
        let mut last_s = f64::NEG_INFINITY;
        let first = self.points.partition_point(|point| point.time_s < newest - window_s);
        for point in self.points.range(first..) {
            let Some(value) = value(point) else { continue };
            let has_gap = point.time_s - last_s > longest_gap_s;
            let number = (point.time_s / width_s).floor();
            if has_gap || number != column.number {
                column.flush(&mut lines, newest);
                column = Column { number, ..Column::default() };
            }
            if has_gap {
                lines.push(Vec::new());
            }
            column.add(point.time_s, value);
            last_s = point.time_s;
        }
        column.flush(&mut lines, newest);
        // A curve ends at the newest sample, even if the last extreme value came before it.
        if let (Some(line), Some(last)) = (lines.last_mut(), self.points.back())
            && let Some(value) = value(last)
            && line.last().is_none_or(|end| end.0 < 0.0)
        {
            line.push((0.0, value));
        }
        lines
    }
}

/// The lowest and the highest value within one column of a plot, each with its time in s.
#[derive(Default)]
struct Column {
    number: f64,
    extremes: Option<[(f64, f64); 2]>,
}

impl Column {
    fn add(&mut self, time_s: f64, value: f64) {
        let [low, high] = self.extremes.get_or_insert([(time_s, value); 2]);
        if value < low.1 {
            *low = (time_s, value);
        }
        if value > high.1 {
            *high = (time_s, value);
        }
    }

    /// Appends the column to the last line, its two points in the order of their times.
    fn flush(&self, lines: &mut Lines, newest: f64) {
        let (Some(line), Some([low, high])) = (lines.last_mut(), self.extremes) else { return };
        let [first, second] = if low.0 <= high.0 { [low, high] } else { [high, low] };
        line.push((first.0 - newest, first.1));
        if second != first {
            line.push((second.0 - newest, second.1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::WireVolts;

    fn history(ticks: impl IntoIterator<Item = (u64, i32)>) -> History {
        let mut history = History::default();
        for (tick, volts) in ticks {
            history.add(&Telemetry { tick, target: WireVolts(volts << 20), ..Telemetry::default() }, 1000);
        }
        history
    }

    #[test]
    fn a_curve_keeps_the_extremes_of_each_column_in_their_order() {
        let history = history((0..10_000).map(|tick| (tick, if tick == 5003 { 400 } else { 100 })));
        let lines = history.curve(10.0, 100, |point| Some(point.target_v));
        assert_eq!(lines.len(), 1);
        assert!(lines[0].len() < 110 && lines[0].is_sorted_by(|a, b| a.0 <= b.0), "{:?}", lines[0]);
        let highest = lines[0].iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!((highest.0 - (5.003 - 9.999)).abs() < 1e-9 && highest.1 == 400.0, "{highest:?}");
    }

    #[test]
    fn a_curve_has_a_gap_where_samples_are_missing_and_shows_the_window_only() {
        let history = history((0..2000).chain(4000..6000).step_by(10).map(|tick| (tick, 1)));
        let lines = history.curve(5.0, 50, |point| Some(point.target_v));
        assert_eq!(lines.len(), 2);
        assert!(lines[0][0].0 >= -5.0 && lines[1].last().unwrap().0 == 0.0, "{lines:?}");
        assert!(history.curve(5.0, 50, |point| point.measured_v).is_empty());
    }

    #[test]
    fn old_samples_and_those_before_a_restart_are_dropped() {
        let long = history((0..400_000).step_by(100).map(|tick| (tick, 1)));
        assert!(long.points.len() <= 3001, "{}", long.points.len());
        let restarted = history([(5000, 1), (5100, 1), (7, 2)]);
        assert_eq!(restarted.points.len(), 1);
    }
}
