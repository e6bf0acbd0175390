//! How good a simulation is: its errors, the noise that they show, and tests of what they should not show.

use std::ops::RangeInclusive;

use crate::answer::{NoiseReport, Quality, ResidualReport};
use crate::fit::engine::{Engine, Fit};
use crate::noise::Noise;
use crate::record::data::Data;
use crate::stats::scale::{FINEST_V, Z, root_mean_square};
use crate::stats::sums::dot;

/// Lags of the residual's correlations.
const LAGS: usize = 20;

/// `unseen` is the residual on held-out stretches; `stops` if the simulation knows of bounds at which readings stop.
pub(crate) fn quality(engine: &Engine, fit: &Fit, unseen: &[f64], stops: bool) -> Quality {
    let observed = engine.observed;
    let error = |residual: &[f64]| root_mean_square(&if stops { observed.errors(residual) } else { residual.into() });
    let rmse = error(&fit.residual);
    let reading = &engine.data.reading;
    let mean = reading.iter().sum::<f64>() / reading.len() as f64;
    let spread = root_mean_square(&reading.iter().map(|value| value - mean).collect::<Vec<_>>());
    Quality {
        rmse,
        // Of readings that never change there is none.
        fit_percent: if spread > FINEST_V { 100.0 * (1.0 - rmse / spread) } else { f64::NAN },
        held_out_rmse: error(unseen),
        one_step_rmse: error(&fit.noise.whitened(&fit.residual)),
    }
}

pub(crate) fn noise_report(noise: &Noise) -> NoiseReport {
    NoiseReport {
        sigma: noise.sigma,
        tail: noise.nu.is_finite().then_some(noise.nu),
        memory_rows: noise.autocorrelation.ar.len(),
    }
}

pub(crate) fn residual_report(data: &Data, fit: &Fit) -> ResidualReport {
    let white = fit.noise.innovations(&fit.residual);
    let changes: Vec<f64> = (0..data.rows())
        .map(|row| if row == 0 { 0.0 } else { data.voltage_v[row] - data.voltage_v[row - 1] })
        .collect();
    // Of the errors with what was `lag` rows before.
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
