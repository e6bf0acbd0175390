//! Intervals between the rows of a record, and turns of the voltage that fall into long ones.

use super::Row;

/// A row is missing where two rows are farther apart than this many times the median.
const GAP: f64 = 1.5;
/// Part of the rows that must follow each other regularly for a longer interval to be a gap.
const REGULAR: f64 = 0.9;

/// Times between neighbouring rows, in s.
fn intervals(rows: &[Row]) -> impl Iterator<Item = f64> {
    rows.windows(2).map(|pair| pair[1].time_s - pair[0].time_s)
}

/// Median time between neighbouring rows, in s; `None` with fewer than two rows.
pub fn median_interval(rows: &[Row]) -> Option<f64> {
    let mut intervals: Vec<f64> = intervals(rows).collect();
    let middle = intervals.len() / 2;
    (!intervals.is_empty()).then(|| *intervals.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Number of gaps in an otherwise regular record between which the voltage turns, up to down or down to up: its extreme value
/// lies between two rows and is not in the record.
pub fn missed_turns(rows: &[Row]) -> usize {
    let intervals: Vec<f64> = intervals(rows).collect();
    let Some(median) = median_interval(rows) else { return 0 };
    let is_gap = |interval: f64| interval > GAP * median;
    if intervals.iter().filter(|interval| !is_gap(**interval)).count() < (REGULAR * intervals.len() as f64) as usize {
        return 0;
    }
    let turns = |four: &[Row]| {
        let change = |from: usize| four[from + 1].voltage_v - four[from].voltage_v;
        change(0) * change(2) < 0.0
    };
    rows.windows(4).filter(|four| is_gap(four[2].time_s - four[1].time_s) && turns(four)).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle with turns at whole multiples of 1 s, in rows 0.1 s apart, without those that `missing` names.
    fn triangle(missing: &[usize]) -> Vec<Row> {
        let row = |line: usize| {
            let time_s = 0.1 * line as f64;
            Row { line, time_s, voltage_v: 100.0 * (time_s - 2.0 * (time_s / 2.0).round()).abs(), measured: None }
        };
        (0..100).filter(|line| !missing.contains(line)).map(row).collect()
    }

    #[test]
    fn turns_within_gaps_are_counted_and_others_are_not() {
        assert_eq!(missed_turns(&triangle(&[])), 0);
        assert_eq!(missed_turns(&triangle(&[10])), 1);
        assert_eq!(missed_turns(&triangle(&[10, 20, 49, 50, 51])), 3);
        assert_eq!(missed_turns(&triangle(&[14, 15, 26])), 0, "between turns");
        assert_eq!(missed_turns(&triangle(&[])[..1]), 0);
        // Rows at uneven times, such as one for each level of a stair, have no gaps.
        let even: Vec<usize> = (0..100).filter(|row| row % 10 != 0 && row % 7 != 0).collect();
        assert_eq!(missed_turns(&triangle(&even)), 0);
    }
}
