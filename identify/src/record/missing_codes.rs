//! Codes that a converter never gives: the response passes them slowly, and no reading shows them.
//!
//! Codes are missing if readings change from the one below them to the one above or back without a change of the voltage, with nothing but
//! these two one reading before and after, again and again. What a missing code stands for is read as the next one that is given, below or
//! above, or as both; nothing tells which. A reading next to missing codes therefore says that the true value is in its own cell or in
//! theirs. The codes beyond the highest and the lowest one that are given may be missing as well.

use std::collections::{BTreeMap, BTreeSet};

/// Fewest changes across a code that prove that it is missing.
const FEWEST_CHANGES: usize = 2;
/// Most codes side by side that may be missing; a response passes more of them in a jump.
const MOST_SIDE_BY_SIDE: i64 = 4;
/// Smallest part of the readings whose neighbouring codes are both given: what is estimated without a search needs them.
const FEWEST_KNOWN: f64 = 0.2;

/// The interval around each reading that its code stands for, relative to the reading.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cells {
    /// Number of missing codes.
    pub(super) missing: usize,
    /// Lowest and highest true value of each row, less its reading; `None` for a row whose neighbouring codes are both given.
    pub(super) wider: Vec<Option<(f64, f64)>>,
}

/// Returns the cells of readings that are multiples of `step` apart; `None` if no code is missing, or nearly every reading is next to
/// one. If some are, any other single code between two given ones that no reading shows counts as missing, too, and more side by side if
/// readings change across them once and the next codes are given.
pub(super) fn cells(reading: &[f64], voltage_v: &[f64], step: f64) -> Option<Cells> {
    let first = *reading.first()?;
    let codes: Vec<i64> = reading.iter().map(|reading| ((reading - first) / step).round() as i64).collect();
    let given: BTreeSet<i64> = codes.iter().copied().collect();
    let mut changes: BTreeMap<(i64, i64), usize> = BTreeMap::new();
    for (four, voltages) in codes.windows(4).zip(voltage_v.windows(4)) {
        let (below, above) = (four[1].min(four[2]), four[1].max(four[2]));
        let only_two = [four[0], four[3]].iter().all(|code| *code == below || *code == above);
        let is_held = voltages.iter().all(|voltage| *voltage == voltages[0]);
        let may_miss = (2..=MOST_SIDE_BY_SIDE + 1).contains(&(above - below));
        if may_miss && only_two && is_held {
            *changes.entry((below, above)).or_default() += 1;
        }
    }
    let pairs: Vec<(i64, i64)> = given.iter().copied().zip(given.iter().copied().skip(1)).collect();
    let is_wide = |pair: &(i64, i64)| pair.1 - pair.0 > 2;
    // One after the other they are the steps of a coarser range.
    let is_alone =
        |at: usize| ![at.wrapping_sub(1), at + 1].iter().any(|&beside| pairs.get(beside).is_some_and(is_wide));
    let is_gap = |&(at, gap): &(usize, &(i64, i64))| {
        gap.1 - gap.0 == 2 || is_wide(gap) && changes.contains_key(gap) && is_alone(at)
    };
    let gaps: Vec<(i64, i64)> = pairs.iter().enumerate().filter(is_gap).map(|(_, gap)| *gap).collect();
    if !gaps.iter().any(|gap| changes.get(gap).is_some_and(|&count| count >= FEWEST_CHANGES)) {
        return None;
    }
    let width = |(below, above): &(i64, i64)| above - below - 1;
    let missing = gaps.iter().map(width).sum::<i64>() as usize;
    let (lowest, highest) = (*given.first()?, *given.last()?);
    let beyond =
        |end: bool, gap: Option<&(i64, i64)>| 0.5 + if end { 1.0 } else { gap.map_or(0.0, |gap| width(gap) as f64) };
    let wider = codes.iter().map(|&code| {
        let below = beyond(code == lowest, gaps.iter().find(|gap| gap.1 == code));
        let above = beyond(code == highest, gaps.iter().find(|gap| gap.0 == code));
        (below + above > 1.0).then_some((-below * step, above * step))
    });
    let wider: Vec<Option<(f64, f64)>> = wider.collect();
    let known = wider.iter().filter(|wider| wider.is_none()).count();
    (known as f64 > FEWEST_KNOWN * wider.len() as f64).then_some(Cells { missing, wider })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    const STEP: f64 = 8.0;
    const ROWS: usize = 1200;

    /// Readings of a response to steps of the voltage, with noise of 1 V, by codes of which `read` makes others.
    fn readings(read: impl Fn(i64) -> i64) -> (Vec<f64>, Vec<f64>) {
        let mut state = 0.0;
        let voltage_v: Vec<f64> = (0..ROWS).map(|row| [100.0, 300.0, 200.0, 0.0][row / 150 % 4]).collect();
        let row = |(voltage, noise): (&f64, f64)| {
            state += (voltage - state) / 25.0;
            3.0 + STEP * read(((state + noise) / STEP).round() as i64) as f64
        };
        (voltage_v.iter().zip(normals(ROWS)).map(row).collect(), voltage_v)
    }

    #[test]
    fn every_fourth_code_is_missing() {
        let (reading, voltage_v) = readings(|code| if code.rem_euclid(4) == 3 { code - 1 } else { code });
        let Cells { missing, wider } = cells(&reading, &voltage_v, STEP).unwrap();
        assert!((6..=10).contains(&missing), "{missing}");
        for (reading, wider) in reading.iter().zip(&wider) {
            let code = ((reading - 3.0) / STEP).round() as i64;
            if let Some((low, high)) = wider {
                let is_extreme = code <= 0 || 8 * code > 290;
                assert!(is_extreme || code.rem_euclid(2) == 0, "{code}");
                assert!(is_extreme || (high - low - 2.0 * STEP).abs() < 1e-9, "{code} {low} {high}");
            }
        }
        assert!(wider.iter().filter(|wider| wider.is_some()).count() > ROWS / 4);
    }

    #[test]
    fn codes_that_are_missing_side_by_side_widen_the_cells_next_to_them() {
        let (reading, voltage_v) =
            readings(|code| if matches!(code.rem_euclid(6), 3 | 4) { code - code.rem_euclid(6) + 2 } else { code });
        let Cells { missing, wider } = cells(&reading, &voltage_v, STEP).unwrap();
        assert!((8..=12).contains(&missing), "{missing}");
        let at =
            |code: i64| reading.iter().position(|reading| ((reading - 3.0) / STEP).round() as i64 == code).unwrap();
        assert_eq!([8, 11, 12].map(|code| wider[at(code)]), [Some((-4.0, 20.0)), Some((-20.0, 4.0)), None]);
    }

    #[test]
    fn the_codes_that_a_coarser_range_leaves_out_are_not_missing() {
        let coarser = |code: i64| if code < 20 { code } else { (code as f64 / 4.0).round() as i64 * 4 };
        let (reading, voltage_v) = readings(coarser);
        assert_eq!(cells(&reading, &voltage_v, STEP), None);
        // With a code that is missing in the finer range, that one alone.
        let (reading, voltage_v) = readings(|code| if code == 9 { 8 } else { coarser(code) });
        assert_eq!(cells(&reading, &voltage_v, STEP).map(|cells| cells.missing), Some(1));
    }

    #[test]
    fn no_code_is_missing_where_the_response_is_fast_or_jumps_with_the_voltage() {
        let (reading, voltage_v) = readings(|code| code);
        assert_eq!(cells(&reading, &voltage_v, STEP), None);
        let voltage_v: Vec<f64> = (0..ROWS).map(|row| [0.0, 2.0 * STEP][row / 50 % 2]).collect();
        assert_eq!(cells(&voltage_v, &voltage_v, STEP), None);
        // Late by 5 rows: jumps while the voltage is held.
        for jump in [2.0, 3.0, 9.0] {
            let square =
                |late: usize| (0..ROWS).map(move |row| [0.0, jump * STEP][(row + 50 - late) / 50 % 2]).collect();
            let [voltage_v, reading]: [Vec<f64>; 2] = [square(0), square(5)];
            assert_eq!(cells(&reading, &voltage_v, STEP), None);
        }
    }
}
