//! The smallest effect that is named, in units of the smallest that can be detected.

use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::score::Outcome;
use super::seam::Diagnose;
use super::summary::quantile;
use super::{apart, detectable};
use crate::hidden::noise::Noise;
use crate::hidden::record::Recipe;
use crate::hidden::{Cause, Hidden};

/// Sizes that are tried, upwards, in units of the detectable size of each record.
pub const RUNGS: [f64; 9] = [1.0, 1.25, 1.5, 2.0, 3.0, 5.0, 8.0, 13.0, 21.0];
/// As many of the records as must be named.
const ENOUGH: f64 = 0.95;

/// What became of one cause's climb.
#[derive(Clone, Debug, Serialize)]
pub struct Climb {
    /// Which cause.
    pub cause: Cause,
    /// Noise in percent of 500 V.
    pub noise_percent: f64,
    /// Records; those whose effect no test could detect at any size are left out.
    pub records: usize,
    /// Median detectable size, in the unit of the cause.
    pub detectable: f64,
    /// The size from which 95 % of the records could be told from another cause at best, in units of the detectable size.
    pub told_apart: f64,
    /// Share of the records that were named, rung by rung, up to the first that is enough.
    pub named: Vec<f64>,
    /// The rung that was enough; none if none was.
    pub ratio: Option<f64>,
    /// Median size at that rung, in the unit of the cause.
    pub size: Option<f64>,
    /// The unit.
    pub unit: &'static str,
}

/// Climbs with `count` records of a cause. No effect grows beyond its plain size.
pub fn climb(
    cause: Cause,
    noise_percent: f64,
    first: u64,
    count: usize,
    diagnose: &Diagnose<'_>,
    progress: &ProgressBar,
) -> Climb {
    let recipe = Recipe { noise: Noise::white(noise_percent), ..Recipe::of(&[cause]) };
    let seeds = (0..count as u64).map(|k| first.wrapping_mul(1_000_000_007) + 700_000_000 + cause as u64 * 10_000 + k);
    let records: Vec<(Hidden, f64)> = seeds
        .collect::<Vec<_>>()
        .into_par_iter()
        .filter_map(|seed| {
            let hidden = recipe.draw(seed);
            detectable::size(&hidden).map(|size| (hidden, size))
        })
        .collect();
    let median = |factor: f64| {
        let sizes = records.iter().map(|(hidden, size)| hidden.effects[0].at((factor * size).min(1.0)).magnitude());
        quantile(&sizes.collect::<Vec<_>>(), 0.5)
    };
    let factors: Vec<f64> = records.par_iter().map(|(hidden, size)| apart::factor(hidden, *size)).collect();
    let mut named = Vec::new();
    let mut ratio = None;
    for rung in RUNGS {
        let one = |(hidden, size): &(Hidden, f64)| {
            let outcome = Outcome::of(&hidden.at((rung * size).min(1.0)), diagnose);
            progress.inc(1);
            outcome.all_named()
        };
        let hits = records.par_iter().filter(|record| one(record)).count();
        named.push(hits as f64 / records.len().max(1) as f64);
        if hits as f64 >= ENOUGH * records.len() as f64 && !records.is_empty() {
            ratio = Some(rung);
            break;
        }
    }
    Climb {
        cause,
        noise_percent,
        records: records.len(),
        detectable: median(1.0).unwrap_or(f64::NAN),
        told_apart: quantile(&factors, ENOUGH).unwrap_or(f64::NAN),
        named,
        ratio,
        size: ratio.and_then(median),
        unit: cause.facts().measure.unit,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_climb_ends_where_the_cause_is_named() {
        // Names a gain error of more than 0.002.
        let oracle = |hidden: &Hidden| {
            let seen = hidden.effects[0].magnitude() > 0.002;
            let findings = if seen { json!([{"cause": "gain-error"}]) } else { json!([]) };
            Ok(json!({"verdict": "explained", "findings": findings}))
        };
        let climb = climb(Cause::GainError, 0.2, 1, 8, &oracle, &ProgressBar::hidden());
        assert_eq!(climb.records, 8);
        assert_eq!(climb.named.last(), Some(&1.0));
        let (ratio, size) = (climb.ratio.unwrap(), climb.size.unwrap());
        assert!(size > 0.002 && (size / climb.detectable - ratio).abs() < 0.05, "{climb:?}");
        assert!(climb.named[0] < 0.95, "{climb:?}");
    }
}
