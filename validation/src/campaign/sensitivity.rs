//! The smallest effect that the diagnosis names, relative to the smallest that can be detected.

use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::diagnosis::Diagnose;
use super::part::seed;
use super::score::Outcome;
use super::{detectable, isolable};
use crate::ground_truth::noise::Noise;
use crate::ground_truth::record::Recipe;
use crate::ground_truth::{Cause, LabelledRecord};
use crate::statistics::{self, quantile};

/// Sizes that are tried in this order, relative to the detectable size of each record.
pub const SIZES: [f64; 9] = [1.0, 1.25, 1.5, 2.0, 3.0, 5.0, 8.0, 13.0, 21.0];
/// Fraction of the records that have to be named.
const ENOUGH: f64 = 0.95;

/// Result for one cause.
#[derive(Clone, Debug, Serialize)]
pub struct Sensitivity {
    /// Cause in the records.
    pub cause: Cause,
    /// Standard deviation of the noise, in percent of 500 V.
    pub noise_percent: f64,
    /// Number of records, without those whose effect cannot be detected at any size.
    pub records: usize,
    /// Median of the detectable size, in the unit of the cause.
    pub detectable: f64,
    /// Size from which 95 % of the records can be distinguished from every other cause, relative to the detectable
    /// size.
    #[serde(rename = "told_apart")]
    pub isolable: f64,
    /// Fraction of the records that were named at each of [`SIZES`], up to the first that reaches 95 %.
    pub named: Vec<f64>,
    /// The first of [`SIZES`] at which 95 % of the records were named; `None` if none was enough.
    pub ratio: Option<f64>,
    /// Median size there, in the unit of the cause.
    pub size: Option<f64>,
    /// Unit of the sizes.
    pub unit: &'static str,
}

/// Diagnoses `count` records of a cause at increasing sizes until 95 % are named. No effect exceeds its full size.
pub fn measure(
    cause: Cause,
    noise_percent: f64,
    first: u64,
    count: usize,
    diagnose: &Diagnose<'_>,
    progress: &ProgressBar,
) -> Sensitivity {
    let recipe = Recipe { noise: Noise::white(noise_percent), ..Recipe::of(&[cause]) };
    let seeds = (0..count).map(|k| seed(first, 7, cause as usize * 10_000 + k));
    let records: Vec<(LabelledRecord, f64)> = seeds
        .collect::<Vec<_>>()
        .into_par_iter()
        .filter_map(|seed| {
            let hidden = recipe.draw(seed);
            detectable::size(&hidden).map(|size| (hidden, size))
        })
        .collect();
    let median = |factor: f64| {
        let sizes = records.iter().map(|(hidden, size)| hidden.effects[0].at((factor * size).min(1.0)).magnitude());
        statistics::median(&sizes.collect::<Vec<_>>())
    };
    let factors: Vec<f64> = records.par_iter().map(|(hidden, size)| isolable::factor(hidden, *size)).collect();
    let mut named = Vec::new();
    let mut ratio = None;
    for factor in SIZES {
        let one = |(hidden, size): &(LabelledRecord, f64)| {
            let outcome = Outcome::of(&hidden.at((factor * size).min(1.0)), diagnose);
            progress.inc(1);
            outcome.all_named()
        };
        let hits = records.par_iter().filter(|record| one(record)).count();
        named.push(hits as f64 / records.len().max(1) as f64);
        if hits as f64 >= ENOUGH * records.len() as f64 && !records.is_empty() {
            ratio = Some(factor);
            break;
        }
    }
    Sensitivity {
        cause,
        noise_percent,
        records: records.len(),
        detectable: median(1.0).unwrap_or(f64::NAN),
        isolable: quantile(&factors, ENOUGH).unwrap_or(f64::NAN),
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
    fn the_search_ends_at_the_first_size_that_is_named() {
        // An oracle that names a gain error of more than 0.002.
        let oracle = |hidden: &LabelledRecord| {
            let seen = hidden.effects[0].magnitude() > 0.002;
            let findings = if seen { json!([{"cause": "gain-error"}]) } else { json!([]) };
            Ok(json!({"verdict": "explained", "findings": findings}))
        };
        let found = measure(Cause::GainError, 0.2, 1, 8, &oracle, &ProgressBar::hidden());
        assert_eq!(found.records, 8);
        assert_eq!(found.named.last(), Some(&1.0));
        let (ratio, size) = (found.ratio.unwrap(), found.size.unwrap());
        assert!(size > 0.002 && (size / found.detectable - ratio).abs() < 0.05, "{found:?}");
        assert!(found.named[0] < 0.95, "{found:?}");
    }
}
