//! Codes that a converter never gives: the response passes them slowly, and no reading shows them.
//!
//! A code `k` is missing if readings change from `k - 1` to `k + 1` or back without a change of the voltage, with nothing but these two
//! codes one reading before and after, again and again. What it stands for is read as one of its neighbours, or as both; nothing tells
//! which. A reading next to a missing code therefore says that the true value is in its own cell or in the missing one. The codes beyond
//! the highest and the lowest one that are given may be missing as well.

use std::collections::{BTreeMap, BTreeSet};

/// Fewest changes across a code that prove that it is missing.
const FEWEST_CHANGES: usize = 2;
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
/// one. If some are, any other code between two given ones that no reading shows counts as missing, too.
pub(super) fn cells(reading: &[f64], voltage_v: &[f64], step: f64) -> Option<Cells> {
    let first = *reading.first()?;
    let codes: Vec<i64> = reading.iter().map(|reading| ((reading - first) / step).round() as i64).collect();
    let given: BTreeSet<i64> = codes.iter().copied().collect();
    let is_skipped = |code: i64| !given.contains(&code) && given.contains(&(code - 1)) && given.contains(&(code + 1));
    let mut changes: BTreeMap<i64, usize> = BTreeMap::new();
    for (four, voltages) in codes.windows(4).zip(voltage_v.windows(4)) {
        let (from, to) = (four[1], four[2]);
        let between = (from + to) / 2;
        let only_two = [four[0], four[3]].iter().all(|code| *code == from || *code == to);
        let is_held = voltages.iter().all(|voltage| *voltage == voltages[0]);
        if (to - from).abs() == 2 && only_two && is_held && is_skipped(between) {
            *changes.entry(between).or_default() += 1;
        }
    }
    if !changes.values().any(|&count| count >= FEWEST_CHANGES) {
        return None;
    }
    let (lowest, highest) = (*given.first()?, *given.last()?);
    let half = |code: i64| if is_skipped(code) || code < lowest || code > highest { 1.5 } else { 0.5 };
    let missing = (lowest..highest).filter(|&code| is_skipped(code)).count();
    let wider = codes.iter().map(|&code| {
        let (below, above) = (half(code - 1), half(code + 1));
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
    fn no_code_is_missing_where_the_response_is_fast_or_jumps_with_the_voltage() {
        let (reading, voltage_v) = readings(|code| code);
        assert_eq!(cells(&reading, &voltage_v, STEP), None);
        let voltage_v: Vec<f64> = (0..ROWS).map(|row| [0.0, 2.0 * STEP][row / 50 % 2]).collect();
        assert_eq!(cells(&voltage_v, &voltage_v, STEP), None);
    }
}
