//! Errors of a simulation, the parameters of its noise, and correlations of its residual.

use std::ops::RangeInclusive;

use crate::answer::{NoiseReport, Quality, ResidualReport};
use crate::fit::engine::{Engine, Fit};
use crate::noise::Noise;
use crate::record::data::Data;
use crate::stats::scale::{centred, root_mean_square};
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::FINEST_V;
use crate::stats::thresholds::probability::Z;

/// Largest lag of the residual's correlations, in rows.
const LAGS: usize = 20;

/// Errors of a fit. `held_out` is its residual on held-out segments, in V; `stops` says that the simulation includes bounds at
/// which readings saturate, so that rows at a bound count only where the fit is within it ([`rms`](crate::record::observed::Observed::rms)).
pub(crate) fn quality(engine: &Engine, fit: &Fit, held_out: &[f64], stops: bool) -> Quality {
    let observed = engine.observed;
    let error = |residual: &[f64]| if stops { observed.rms(residual) } else { root_mean_square(residual) };
    let rmse = error(&fit.residual);
    Quality {
        rmse,
        fit_percent: fit_percent(rmse, &engine.data.reading, FINEST_V.get()),
        held_out_rmse: error(held_out),
        one_step_rmse: error(&fit.noise.whitened(&fit.residual)),
    }
}

/// The part of the spread of `readings` that is left out of an error with this root mean square, in percent: 100 where there is no
/// error, and undefined, NaN, for readings that never change by more than `finest`; all three in one unit.
pub(crate) fn fit_percent(rmse: f64, readings: &[f64], finest: f64) -> f64 {
    let spread = root_mean_square(&centred(readings));
    if spread > finest { 100.0 * (1.0 - rmse / spread) } else { f64::NAN }
}

/// Parameters of the noise for the report.
pub(crate) fn noise_report(noise: &Noise) -> NoiseReport {
    NoiseReport {
        sigma: noise.sigma,
        tail: noise.nu.is_finite().then_some(noise.nu),
        memory_rows: noise.autocorrelation.ar.len(),
    }
}

/// Correlations of the whitened residual with itself and with changes of the voltage.
pub(crate) fn residual_report(data: &Data, fit: &Fit) -> ResidualReport {
    let white = fit.noise.innovations(&fit.residual);
    let changes: Vec<f64> = (0..data.rows())
        .map(|row| if row == 0 { 0.0 } else { data.voltage_v[row] - data.voltage_v[row - 1] })
        .collect();
    // Correlation of the errors with values `lag` rows earlier.
    let correlation = |earlier: &[f64], lags: RangeInclusive<usize>| {
        let size = (dot(&white, &white) * dot(earlier, earlier)).sqrt().max(1e-300);
        lags.map(|lag| dot(&white[lag.min(white.len())..], earlier) / size).collect()
    };
    ResidualReport {
        autocorrelation: correlation(&white, 1..=LAGS),
        input_correlation: correlation(&changes, 0..=LAGS),
        band: Z / (data.rows().max(1) as f64).sqrt(),
    }
}
