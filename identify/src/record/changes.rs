//! Changes of the voltage, and whether readings follow them by more than chance.

use crate::stats::thresholds::empirical::CHANGE_OF_FULL_SCALE;
use crate::stats::thresholds::probability::Z_RARE;

/// Returns the rows at which a voltage changes, with the magnitude of the change; smaller ones than [`CHANGE_OF_FULL_SCALE`] may be the
/// noise of a measured voltage.
pub(crate) fn changes(voltage: &[f64], full_scale: f64) -> impl Iterator<Item = (usize, f64)> + '_ {
    let changes = voltage.windows(2).enumerate().map(|(row, pair)| (row + 1, (pair[1] - pair[0]).abs()));
    changes.filter(move |(_, change)| *change > CHANGE_OF_FULL_SCALE.get() * full_scale)
}

/// Returns true if more of `all` readings are just after a change than independent ones would be, `after` telling which rows are.
pub(crate) fn follow(all: usize, just_after: usize, after: &[bool]) -> bool {
    let part = after.iter().filter(|after| **after).count() as f64 / after.len() as f64;
    let (all, count) = (all as f64, just_after as f64);
    count - all * part > Z_RARE * (all * part * (1.0 - part)).sqrt()
}
