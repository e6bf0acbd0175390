//! Causes that show in the readings themselves: quantisation, saturation, outliers.

use crate::adequacy::far_off;
use crate::answer::{Finding, Parameter};
use crate::dimension::Dimension;
use crate::fit::engine::Fit;
use crate::record::data::Data;
use crate::record::observed::Observed;
use crate::record::quantisation_grid::QuantisationGrid;
use crate::stats::scale::root_mean_square;
use crate::stats::thresholds::empirical::{FINEST_V, STEP_TO_REPORT};
use crate::stats::thresholds::probability::Z;

/// Smallest noise from row to row with which a step is compared, relative to the whole error.
const LEAST_STEP_PER_ERROR: f64 = 0.2;

/// Findings in the readings; far readings are outliers only if `isolated`, which says that they neither come in runs nor follow
/// changes of the command.
pub(crate) fn reading_findings(data: &Data, observed: &Observed, fit: &Fit, isolated: bool) -> Vec<Finding> {
    let mut findings = Vec::new();
    let raw = root_mean_square(&fit.residual);
    let stopped_raw = observed.rms(&fit.residual);
    // An error that nothing explains does not make coarse steps fine.
    let noise_v = observed.scatter_v.max(LEAST_STEP_PER_ERROR * stopped_raw);
    let predicted: Vec<f64> = data.reading.iter().zip(&fit.residual).map(|(reading, left)| reading - left).collect();
    let scales = data.scales();
    let single = |name: &str, value: f64, low: f64, high: f64, dimension| {
        vec![(
            name.to_owned(),
            Parameter { value, low, high, unit: String::new(), at_bound: false, extrapolated_from_v: None, dimension },
        )]
    };
    if let Some(QuantisationGrid { step, low, high }) = observed.grid
        && (step > (STEP_TO_REPORT.get() * stopped_raw.min(noise_v)).max(2.0 * FINEST_V.get())
            || observed.truncation_v != 0.0)
    {
        let grid = data.reading[0];
        let after: Vec<f64> = data
            .reading
            .iter()
            .zip(&predicted)
            .map(|(reading, predicted)| reading - (((predicted - grid) / step).round() * step + grid))
            .collect();
        let mut parameters = single("step", step, low, high, Dimension::ReadingSize);
        if observed.missing_codes > 0 {
            let missing = observed.missing_codes as f64;
            parameters.extend(single("missing_codes", missing, missing, missing, Dimension::Ratio));
        }
        findings.push(Finding {
            cause: "quantisation",
            probability: 1.0,
            parameters,
            rmse_before: root_mean_square(
                &fit.residual.iter().map(|left| left - observed.truncation_v).collect::<Vec<_>>(),
            ),
            rmse_after: root_mean_square(&after).min(raw),
            evidence: format!(
                "all readings differ from the first by multiples of {}, {:.1} times the remaining error{}",
                scales.shown(Dimension::ReadingSize, step, 6),
                step / raw,
                if observed.truncation_v == 0.0 {
                    ""
                } else {
                    "; readings were cut off to the step below, not rounded"
                }
            ),
            proved: true,
        });
    }
    for (bound, upper) in [(observed.upper, true), (observed.lower, false)] {
        let Some(bound) = bound else { continue };
        let stopped = data.reading.iter().filter(|&&reading| reading == bound).count();
        let beyond =
            data.reading.iter().filter(|&&reading| if upper { reading > bound } else { reading < bound }).count();
        findings.push(Finding {
            cause: "sensor-saturation",
            probability: 1.0,
            parameters: single(
                "limit",
                bound,
                bound - 1e-6 * bound.abs(),
                bound + 1e-6 * bound.abs(),
                Dimension::Reading,
            ),
            rmse_before: raw,
            rmse_after: stopped_raw,
            evidence: format!(
                "{stopped} readings are exactly {}, the {} of all{}",
                scales.restored(Dimension::Reading, bound),
                if upper == (scales.reading > 0.0) { "highest" } else { "lowest" },
                if beyond > 0 { format!(" but for single ones ({beyond})") } else { String::new() }
            ),
            proved: true,
        });
    }
    if let Some((_, wide)) = fit.noise.outliers.filter(|_| isolated) {
        let errors = observed.errors(&fit.residual);
        let far = far_off(&fit.noise, &fit.noise.innovations(&errors));
        let kept: Vec<f64> = errors.iter().zip(&far).filter(|(_, far)| !**far).map(|(error, _)| *error).collect();
        let (rows, off) = (errors.len(), errors.len() - kept.len());
        let fraction = off as f64 / rows as f64;
        let spread = (fraction * (1.0 - fraction) / rows as f64).sqrt();
        findings.push(Finding {
            cause: "outliers",
            probability: 1.0,
            parameters: single("fraction", fraction, (fraction - Z * spread).max(0.0), fraction + Z * spread, Dimension::Ratio),
            rmse_before: stopped_raw,
            rmse_after: root_mean_square(&kept),
            evidence: format!(
                "{off} readings are off by about {}, {:.0} times the noise: a mixture of two normal distributions fits far better than one heavy tail",
                scales.shown(Dimension::ReadingSize, wide, 2),
                wide / fit.noise.sigma
            ),
            proved: false,
        });
    }
    findings
}
