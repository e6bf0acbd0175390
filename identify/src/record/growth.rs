//! Noise that grows with the reading, seen in the readings themselves.
//!
//! ```text
//! scale(level) = a + b level,      level = median of |reading| over five rows
//! ```
//!
//! A sensor whose error is a part of what it reads scatters more under high voltage. Taken for even noise, a far reading there
//! passes for a shift, or for an outlier. The scale is that of second differences, of which a slow signal has none, in groups
//! of rows of like level; it counts only if it grows beyond doubt.

use std::sync::Arc;

use crate::record::data::Data;
use crate::stats::median::running;
use crate::stats::scale::bends;
use crate::stats::scale::scale;

/// Groups of like level.
const GROUPS: usize = 10;
/// Fewest rows of a group that tell a scale.
const FEWEST: usize = 20;
/// Relative error of a scale from one row's second difference; neighbours are not independent.
const ERROR: f64 = 1.5;
/// Growth is beyond doubt if so many standard deviations large,
const CERTAIN: f64 = 6.0;
/// and worth a word from this ratio between the highest and the lowest level on.
const RATIO: f64 = 1.3;

/// One over each row's scale, their geometric mean 1; `None` if the noise does not grow. Rows for which `counts` is false do
/// not tell.
pub(crate) fn weights(data: &Data, counts: impl Fn(usize) -> bool) -> Option<Arc<[f64]>> {
    let mut rows: Vec<usize> =
        (1..data.rows().saturating_sub(1)).filter(|row| (row - 1..=row + 1).all(&counts)).collect();
    if rows.len() < GROUPS * FEWEST {
        return None;
    }
    let reading = &data.reading;
    let bends: Vec<f64> = bends(reading).collect();
    let level = running(&reading.iter().map(|reading| reading.abs()).collect::<Vec<_>>());
    rows.sort_by(|a, b| level[*a].total_cmp(&level[*b]));
    let of_group = |rows: &[usize]| {
        let middle = rows.iter().map(|row| level[*row]).sum::<f64>() / rows.len() as f64;
        let scale = scale(&rows.iter().map(|row| bends[row - 1]).collect::<Vec<_>>());
        // Level, scale, and what the scale is worth.
        (middle, scale, rows.len() as f64 / (ERROR * scale).powi(2))
    };
    let groups: Vec<(f64, f64, f64)> = rows.chunks(rows.len().div_ceil(GROUPS)).map(of_group).collect();
    let worth: f64 = groups.iter().map(|group| group.2).sum();
    let mean =
        |of: &dyn Fn(&(f64, f64, f64)) -> f64| groups.iter().map(|group| group.2 * of(group)).sum::<f64>() / worth;
    let (mean_level, mean_scale) = (mean(&|group| group.0), mean(&|group| group.1));
    let spread = worth * mean(&|group| (group.0 - mean_level).powi(2));
    let slope = worth * mean(&|group| (group.0 - mean_level) * (group.1 - mean_scale)) / spread.max(f64::MIN_POSITIVE);
    let least = groups.iter().map(|group| group.1).fold(f64::INFINITY, f64::min);
    let of_level = |level: f64| (mean_scale + slope * (level - mean_level)).max(least / 2.0);
    let (lowest, highest) = (of_level(groups.first()?.0), of_level(groups.last()?.0));
    if slope * spread.sqrt() < CERTAIN || highest < RATIO * lowest {
        return None;
    }
    let scales: Vec<f64> = level.into_iter().map(of_level).collect();
    let mean = (scales.iter().map(|scale| scale.ln()).sum::<f64>() / scales.len() as f64).exp();
    Some(scales.into_iter().map(|scale| mean / scale).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::data::Input;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// A sweep up and down under noise of a scale for each level.
    fn of(scale: impl Fn(f64) -> f64) -> Option<Arc<[f64]>> {
        let row = |(row, noise): (usize, f64)| {
            let level = 0.5 * (1000.0 - row as f64).abs();
            Row { line: row, time_s: row as f64, voltage_v: level, measured: Some(level + scale(level) * noise) }
        };
        let rows = normals(2000).into_iter().enumerate().map(row).collect();
        weights(&Data::new(&Record { name: String::new(), rows }, Input::Hold), |_| true)
    }

    #[test]
    fn a_scale_that_grows_is_recovered() {
        let weights = of(|level| 0.2 + 0.004 * level).unwrap();
        // At 50 and at 500 V.
        let ratio = weights[900] / weights[0];
        assert!((4.5..6.5).contains(&ratio), "{ratio} beside 5.5");
        let mean = weights.iter().map(|weight| weight.ln()).sum::<f64>();
        assert!(mean.abs() < 1e-9, "{mean}");
        assert!(of(|_| 1.0).is_none());
        assert!(of(|level| 1.0 - 0.001 * level).is_none());
    }
}
