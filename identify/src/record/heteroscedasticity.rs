//! Noise whose scale grows with the reading (heteroscedastic noise), estimated from the readings alone.
//!
//! ```text
//! scale(level) = a + b level,      level = median of |reading| over five rows
//! ```
//!
//! The noise of a sensor with an error proportional to its reading is larger under high voltage. Under a constant
//! scale, a reading with a large error there would be taken for an offset or an outlier. The scale is estimated from
//! second differences, in groups of rows with similar level, and used only if its growth is significant.

use std::sync::Arc;

use crate::record::data::Data;
use crate::stats::median::running_median;
use crate::stats::scale::robust_scale;
use crate::stats::scale::second_differences;
use crate::stats::thresholds::empirical::{FEWEST_ROWS_OF_LEVEL, RELEVANT_RATIO, SIGNIFICANT_SLOPE};

/// Number of groups of similar level.
const GROUPS: usize = 10;
/// Relative standard error of a scale estimated from one second difference; neighbouring differences are correlated.
const RELATIVE_ERROR: f64 = 1.5;

/// Returns the reciprocal scale of each row, normalised to a geometric mean of 1; `None` if the scale does not grow
/// significantly. Rows for which `counts` is false are not used for the estimate.
pub(crate) fn weights(data: &Data, counts: impl Fn(usize) -> bool) -> Option<Arc<[f64]>> {
    let mut rows: Vec<usize> =
        (1..data.rows().saturating_sub(1)).filter(|row| (row - 1..=row + 1).all(&counts)).collect();
    if rows.len() < GROUPS * FEWEST_ROWS_OF_LEVEL.count() {
        return None;
    }
    let reading = &data.reading;
    let differences: Vec<f64> = second_differences(reading).collect();
    let level = running_median(&reading.iter().map(|reading| reading.abs()).collect::<Vec<_>>());
    rows.sort_by(|a, b| level[*a].total_cmp(&level[*b]));
    let of_group = |rows: &[usize]| {
        let middle = rows.iter().map(|row| level[*row]).sum::<f64>() / rows.len() as f64;
        let scale = robust_scale(&rows.iter().map(|row| differences[row - 1]).collect::<Vec<_>>());
        // The mean level, the scale, and the weight of the group, which is one over the variance of its scale.
        (middle, scale, rows.len() as f64 / (RELATIVE_ERROR * scale).powi(2))
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
    if slope * spread.sqrt() < SIGNIFICANT_SLOPE.get() || highest < RELEVANT_RATIO.get() * lowest {
        return None;
    }
    let scales: Vec<f64> = level.into_iter().map(of_level).collect();
    let mean = (scales.iter().map(|scale| scale.ln()).sum::<f64>() / scales.len() as f64).exp();
    Some(scales.into_iter().map(|scale| mean / scale).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::input::Input;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// Returns the weights for a sweep of the voltage up and down, with noise of the given scale at each level.
    fn of(scale: impl Fn(f64) -> f64) -> Option<Arc<[f64]>> {
        let row = |(row, noise): (usize, f64)| {
            let level = 0.5 * (1000.0 - row as f64).abs();
            Row { line: row, time_s: row as f64, voltage_v: level, measured: Some(level + scale(level) * noise) }
        };
        let rows = normals(2000).into_iter().enumerate().map(row).collect();
        weights(&Data::new(&Record { name: String::new(), rows }, Input::Hold), |_| true)
    }

    #[test]
    fn growing_noise_scale_is_recovered() {
        let weights = of(|level| 0.2 + 0.004 * level).unwrap();
        // The levels are 50 V and 500 V.
        let ratio = weights[900] / weights[0];
        assert!((4.5..6.5).contains(&ratio), "{ratio} instead of 5.5");
        let mean = weights.iter().map(|weight| weight.ln()).sum::<f64>();
        assert!(mean.abs() < 1e-9, "{mean}");
        assert!(of(|_| 1.0).is_none());
        assert!(of(|level| 1.0 - 0.001 * level).is_none());
    }
}
