//! The rows between which something begins or ends, as far as the residual tells.

use std::ops::RangeInclusive;

use crate::stats::thresholds::probability::NATS_WITHIN_INTERVAL;

/// A boundary is moved by at most the number of rows over this.
const REACH: usize = 10;

/// Returns the rows to which a boundary in front of `row` may be moved for less than [`NATS_WITHIN_INTERVAL`] (95 %), with one row more
/// on either side. `back` is the cost, in nats, of moving it back over a row, `ahead` that of moving it ahead over one.
pub(super) fn range(
    row: usize,
    rows: usize,
    back: impl Fn(usize) -> f64,
    ahead: impl Fn(usize) -> f64,
) -> RangeInclusive<usize> {
    fn reach(rows: impl Iterator<Item = usize>, most: usize, cost: impl Fn(usize) -> f64) -> Option<usize> {
        let costs = rows.scan(0.0, |sum, row| {
            *sum += cost(row);
            Some((row, *sum))
        });
        costs.take(most).filter(|(_, sum)| *sum < NATS_WITHIN_INTERVAL).last().map(|(row, _)| row)
    }
    let earliest = reach((0..row).rev(), rows / REACH, back).unwrap_or(row).saturating_sub(1);
    let latest = reach(row..rows, rows / REACH, ahead).map_or(row, |row| row + 1);
    earliest..=latest.min(rows - 1)
}
