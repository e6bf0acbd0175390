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

/// Smallest noise with which a step is compared, relative to the whole error. It is that from row to row, or what one row adds to the ones
/// before: of autocorrelated noise the differences of neighbours show a part.
const LEAST_STEP_PER_ERROR: f64 = 0.2;
/// Half of the interval of a bound that readings show exactly, relative to it.
const EXACT: f64 = 1e-6;

/// Findings in the readings; far readings are outliers only if `isolated`, which says that they neither come in runs nor follow
/// changes of the command.
pub(crate) fn reading_findings(data: &Data, observed: &Observed, fit: &Fit, isolated: bool) -> Vec<Finding> {
    let mut findings = Vec::new();
    findings.extend(quantisation(data, observed, fit));
    findings.extend(saturation(data, observed, fit));
    findings.extend(outliers(data, observed, fit).filter(|_| isolated));
    findings
}

/// A parameter of a finding: its name, and value and interval in the coordinates of the search.
fn parameter(name: &str, value: f64, [low, high]: [f64; 2], dimension: Dimension) -> (String, Parameter) {
    let unit = String::new();
    (name.to_owned(), Parameter { value, low, high, unit, at_bound: false, extrapolated_from_v: None, dimension })
}

/// Readings on a grid whose step is coarse compared with the noise, or that were cut off to it.
fn quantisation(data: &Data, observed: &Observed, fit: &Fit) -> Option<Finding> {
    let QuantisationGrid { step, low, high } = observed.grid?;
    let (raw, within) = (root_mean_square(&fit.residual), observed.rms(&fit.residual));
    let is_cut_off = observed.truncation_v != 0.0;
    // An error that nothing explains does not make coarse steps fine.
    let noise_v = observed.scatter_v.max(fit.noise.sigma).max(LEAST_STEP_PER_ERROR * within);
    let reported = (STEP_TO_REPORT.get() * within.min(noise_v)).max(2.0 * FINEST_V.get());
    if step <= reported && !is_cut_off {
        return None;
    }
    let grid = data.reading[0];
    let off_grid = |(reading, left): (&f64, &f64)| reading - (((reading - left - grid) / step).round() * step + grid);
    let after: Vec<f64> = data.reading.iter().zip(&fit.residual).map(off_grid).collect();
    let before: Vec<f64> = fit.residual.iter().map(|left| left - observed.truncation_v).collect();
    let mut parameters = vec![parameter("step", step, [low, high], Dimension::ReadingSize)];
    if observed.missing_codes > 0 {
        let missing = observed.missing_codes as f64;
        parameters.push(parameter("missing_codes", missing, [missing; 2], Dimension::Ratio));
    }
    Some(Finding {
        cause: "quantisation",
        probability: 1.0,
        parameters,
        rmse_before: root_mean_square(&before),
        rmse_after: root_mean_square(&after).min(raw),
        evidence: format!(
            "all readings differ from the first by multiples of {}, {:.1} times the remaining error{}",
            data.scales().shown(Dimension::ReadingSize, step, 6),
            step / raw,
            if is_cut_off { "; readings were cut off to the step below, not rounded" } else { "" }
        ),
        proved: true,
    })
}

/// Readings that stop at a bound, above, below or both.
fn saturation(data: &Data, observed: &Observed, fit: &Fit) -> impl Iterator<Item = Finding> {
    let scales = data.scales();
    let bounds = [(observed.upper, true), (observed.lower, false)].into_iter();
    bounds.filter_map(|(bound, upper)| Some((bound?, upper))).map(move |(bound, upper)| {
        let count = |is: &dyn Fn(f64) -> bool| data.reading.iter().filter(|reading| is(**reading)).count();
        let stopped = count(&|reading| reading == bound);
        let beyond = count(&|reading| if upper { reading > bound } else { reading < bound });
        let exact = [-1.0, 1.0].map(|side| bound + side * EXACT * bound.abs());
        Finding {
            cause: "sensor-saturation",
            probability: 1.0,
            parameters: vec![parameter("limit", bound, exact, Dimension::Reading)],
            rmse_before: root_mean_square(&fit.residual),
            rmse_after: observed.rms(&fit.residual),
            evidence: format!(
                "{stopped} readings are exactly {}, the {} of all{}",
                scales.restored(Dimension::Reading, bound),
                if upper == (scales.reading > 0.0) { "highest" } else { "lowest" },
                if beyond > 0 { format!(" but for single ones ({beyond})") } else { String::new() }
            ),
            proved: true,
        }
    })
}

/// Readings of a second, much wider law of errors.
fn outliers(data: &Data, observed: &Observed, fit: &Fit) -> Option<Finding> {
    let (_, wide) = fit.noise.outliers?;
    let errors = observed.errors(&fit.residual);
    let far = far_off(&fit.noise, &fit.noise.innovations(&errors));
    let kept: Vec<f64> = errors.iter().zip(&far).filter(|(_, far)| !**far).map(|(error, _)| *error).collect();
    let (rows, off) = (errors.len(), errors.len() - kept.len());
    let fraction = off as f64 / rows as f64;
    let spread = (fraction * (1.0 - fraction) / rows as f64).sqrt();
    let interval = [(fraction - Z * spread).max(0.0), fraction + Z * spread];
    Some(Finding {
        cause: "outliers",
        probability: 1.0,
        parameters: vec![parameter("fraction", fraction, interval, Dimension::Ratio)],
        rmse_before: observed.rms(&fit.residual),
        rmse_after: root_mean_square(&kept),
        evidence: format!(
            "{off} readings are off by about {}, {:.0} times the noise: a mixture of two normal distributions fits far better than one heavy tail",
            data.scales().shown(Dimension::ReadingSize, wide, 2),
            wide / fit.noise.sigma
        ),
        proved: false,
    })
}
