//! The values of all series of a plot at common positions, for the table under it and for the hover text.

use identify::dimension::significant;

use super::axis::Axis;
use super::{Chart, Series};

/// Largest number of positions.
const MOST: usize = 50;

/// Values of the series of a plot.
pub(in crate::output) struct Values {
    /// Name of the column of positions, then of each series.
    pub(in crate::output) names: Vec<String>,
    /// Position, and the values there; `-` where a series has none.
    pub(in crate::output) rows: Vec<Vec<String>>,
    /// The positions in the unit of the horizontal axis, increasing.
    pub(super) positions: Vec<f64>,
}

impl Values {
    /// At the points if there are few, otherwise at round positions.
    pub(super) fn of(chart: &Chart) -> Self {
        let positions = positions(chart);
        let names = std::iter::once(&chart.x).chain(chart.series.iter().map(|series| &series.name));
        let row = |(index, &at): (usize, &f64)| {
            let span = span(&positions, index);
            let values = chart.series.iter().map(|series| value(series, at, span));
            std::iter::once(significant(at, 4)).chain(values).collect()
        };
        Self { names: names.cloned().collect(), rows: positions.iter().enumerate().map(row).collect(), positions }
    }
}

/// The positions of separate points, or of the ends of short lines, if there are few; otherwise round numbers.
fn positions(chart: &Chart) -> Vec<f64> {
    let points = || chart.series.iter().flat_map(|series| &series.points).map(|point| point.0);
    let separate = chart.series.iter().filter(|series| !series.shape.is_line()).flat_map(|series| &series.points);
    let mut own: Vec<f64> = separate.map(|point| point.0).collect();
    if own.is_empty() {
        own = points().collect();
    }
    own.sort_by(f64::total_cmp);
    own.dedup();
    if own.len() <= MOST { own } else { Axis::exact(points()).ticks(MOST).values }
}

/// The part of the horizontal axis that is nearer to a position than to any other.
pub(super) fn span(positions: &[f64], index: usize) -> [f64; 2] {
    let middle = |left: usize| 0.5 * (positions[left] + positions[left + 1]);
    let left = if index == 0 { f64::NEG_INFINITY } else { middle(index - 1) };
    [left, if index + 1 == positions.len() { f64::INFINITY } else { middle(index) }]
}

/// The value of a line at a position; the values of separate points within the span of the position.
fn value(series: &Series, at: f64, [from, to]: [f64; 2]) -> String {
    let none = || "-".to_owned();
    if series.shape.is_line() {
        let on = |pair: &&[(f64, f64)]| pair[0].0 <= at && at <= pair[1].0;
        let between = |pair: &[(f64, f64)]| {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
            if x1 > x0 { y0 + (y1 - y0) * (at - x0) / (x1 - x0) } else { y1 }
        };
        return series.points.windows(2).rfind(on).map_or_else(none, |pair| significant(between(pair), 4));
    }
    let here = series.points.iter().filter(|(x, _)| (from..to).contains(x)).map(|point| point.1);
    let (low, high) = here.fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)));
    match low.total_cmp(&high) {
        std::cmp::Ordering::Greater => none(),
        std::cmp::Ordering::Equal => significant(low, 4),
        std::cmp::Ordering::Less => format!("{} to {}", significant(low, 4), significant(high, 4)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::chart::Shape;

    #[test]
    fn lines_are_interpolated_and_separate_points_are_listed_as_they_are() {
        let line = Series::line("line", "#000000", vec![(0.0, 0.0), (10.0, 100.0)]);
        let points =
            Series::new("points", "#000000", Shape::Discs(3.0), vec![(1.0, 7.0), (4.0, 8.0), (4.0, 9.0), (12.0, 1.0)]);
        let values = Chart::new("", "time [s]", "", vec![line, points]).values();
        assert_eq!(values.names, ["time [s]", "line", "points"]);
        assert_eq!(values.rows[0], ["1.000", "10.00", "7.000"]);
        assert_eq!(values.rows[1], ["4.000", "40.00", "8.000 to 9.000"]);
        assert_eq!(values.rows[2], ["12.00", "-", "1.000"]);
    }

    #[test]
    fn a_long_line_is_listed_at_round_positions() {
        let line =
            Series::line("line", "#000000", (0..1000).map(|row| (f64::from(row) * 0.0745, f64::from(row))).collect());
        let values = Chart::new("", "time [s]", "", vec![line]).values();
        assert_eq!(values.positions[..3], [0.0, 2.0, 4.0]);
        assert!(values.rows.iter().all(|row| row[1] != "-"), "{:?}", values.rows);
    }
}
