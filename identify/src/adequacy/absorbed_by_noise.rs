//! Check for structure that the noise model absorbs as autocorrelation.
//!
//! An autoregression predicts a slow error as well as slow noise, whatever the cause, so that whitened residuals show
//! nothing. Three properties distinguish structure from autocorrelated noise: noise decorrelates within the record, so that
//! its means over long parts are small compared with its scale; its autocorrelation is the same in both halves of the record;
//! and its spectrum has no line:
//!
//! ```text
//! slow    = mean_k(mean_k^2) / mean(e^2)                             over SWING_PARTS parts of the record
//! changed = sum_halves rows/2 ln(var(e whitened by the other half's model) / var(e whitened by its own))      [nats]
//! line    = max_f(power(f) / mean power of the frequencies around f)
//! ```
//!
//! 1/f noise, the slowest that a sensor has, stays below 0.6 and 40 nats in 2400 rows; so does a first-order
//! autoregression with a coefficient of 0.99.

use crate::adequacy::check::{Candidate, Check, Inadequacy, UnmodelledDynamics};
use crate::adequacy::localisation::Localisation;
use crate::dimension::Dimension;
use crate::fit::engine::Engine;
use crate::noise::autocorrelation::Autocorrelation;
use crate::record::data::Data;
use crate::record::spectrum;
use crate::stats::scale::{robust_scale, root_mean_square};
use crate::stats::thresholds::empirical::{
    CHANGE_NATS, CHANGE_NATS_PER_ROW, CLIP_FOR_AUTOCORRELATION, LINE_TO_NEIGHBOURS, ROWS_PER_SWING, SLOW_SHARE,
};

/// Parts of the record whose means are compared with the error's scale.
const SWING_PARTS: usize = 8;

/// The check of a fit whose noise is autocorrelated.
pub(super) struct AbsorbedByNoise;

impl Check for AbsorbedByNoise {
    fn name(&self) -> &'static str {
        "absorbed_by_noise"
    }

    fn test(&self, engine: &mut Engine, Candidate { fit, .. }: &Candidate) -> Option<Inadequacy> {
        let errors = engine.observed.errors(&fit.residual);
        absorbed(engine.data, &errors, &fit.noise.autocorrelation).map(Inadequacy::from)
    }
}

/// Tests errors in V that the noise model predicts by `memory`, its autoregression.
fn absorbed(data: &Data, errors: &[f64], memory: &Autocorrelation) -> Option<UnmodelledDynamics> {
    if errors.len() < ROWS_PER_SWING.count() * SWING_PARTS || memory.is_white() {
        return None;
    }
    let found = |place: &str, share: f64| {
        let place = place.to_owned() + &Localisation::new(data, errors).words();
        UnmodelledDynamics::certain(place, share, share.sqrt() * root_mean_square(errors))
    };
    let slow = slow(errors);
    if slow > SLOW_SHARE.get() {
        return Some(found("as a slow swing over the whole record", slow));
    }
    let changed = changed(errors);
    if changed > CHANGE_NATS.get().max(CHANGE_NATS_PER_ROW.get() * errors.len() as f64) {
        let new = root_mean_square(&memory.whitened(errors)) / root_mean_square(errors);
        return Some(found("as a rhythm that changes along the record", (1.0 - new * new).max(0.0)));
    }
    let line = spectrum::most_prominent_line(errors, data, spectrum::OF_A_SINE)
        .filter(|line| line.prominence > LINE_TO_NEIGHBOURS.get())?;
    let frequency = data.scales().shown(Dimension::Frequency, line.frequency_hz, 3);
    Some(found(&format!("at a frequency of {frequency}"), line.share))
}

/// Mean square of the parts' means over the mean square of all errors, 0 to 1.
fn slow(errors: &[f64]) -> f64 {
    let parts = errors.chunks_exact(errors.len() / SWING_PARTS).take(SWING_PARTS);
    let means = parts.map(|part| (part.iter().sum::<f64>() / part.len() as f64).powi(2));
    means.sum::<f64>() / SWING_PARTS as f64 / root_mean_square(errors).powi(2)
}

/// Log-likelihood that the halves lose, in nats, when each is whitened by the autocorrelation of the other.
fn changed(errors: &[f64]) -> f64 {
    let (early, late) = errors.split_at(errors.len() / 2);
    let [of_early, of_late] = [early, late].map(|half| Autocorrelation::fitted(half, robust_scale(half)));
    let loss = |half: &[f64], own: &Autocorrelation, other: &Autocorrelation| {
        let own = own.whitened(half);
        let bound = CLIP_FOR_AUTOCORRELATION.get() * robust_scale(&own);
        let size =
            |white: Vec<f64>| root_mean_square(&white.iter().map(|e| e.clamp(-bound, bound)).collect::<Vec<_>>());
        half.len() as f64 * (size(other.whitened(half)) / size(own)).ln()
    };
    loss(early, &of_early, &of_late) + loss(late, &of_late, &of_early)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::input::Input;
    use random_numbers::Lcg64;
    use simulation::record::{Record, Row};

    /// Independent errors of unit variance, nearly normal.
    fn errors(rows: usize) -> Vec<f64> {
        let mut numbers = Lcg64::new(7);
        (0..rows).map(|_| numbers.normal()).collect()
    }

    fn place_of(of_row: impl Fn(f64) -> f64) -> Option<String> {
        let errors: Vec<f64> =
            errors(2401).iter().enumerate().map(|(row, e)| e + of_row(row as f64 / 2401.0)).collect();
        tested(&errors).map(|found| found.place)
    }

    fn tested(errors: &[f64]) -> Option<UnmodelledDynamics> {
        let row = |row: usize| Row { line: row, time_s: 0.1 * row as f64, voltage_v: 0.0, measured: Some(0.0) };
        let record = Record { name: String::new(), rows: (0..errors.len()).map(row).collect() };
        absorbed(&Data::new(&record, Input::Hold), errors, &Autocorrelation::fitted(errors, robust_scale(errors)))
    }

    #[test]
    fn swings_chirps_and_lines_are_not_absorbed() {
        use std::f64::consts::{PI, TAU};
        for slow in [place_of(|t| 20.0 * (PI * t).sin()), place_of(|t| 30.0 * (-6.0 * t).exp()), place_of(|_| 20.0)] {
            assert!(slow.as_ref().is_some_and(|place| place.contains("slow swing")), "{slow:?}");
        }
        let chirp = place_of(|t| 10.0 * (TAU * (2.4 * t + 30.0 * t * t)).sin());
        let line = place_of(|t| 4.0 * (TAU * 300.3 * t).sin());
        assert!(line.as_ref().is_some_and(|place| place.contains("1.251 Hz")), "{line:?}");
        assert!(chirp.as_ref().is_some_and(|place| place.contains("rhythm")), "{chirp:?}");
    }

    #[test]
    fn autocorrelated_noise_passes() {
        for coefficient in [0.0, 0.5, 0.8, 0.95] {
            let mut last = 0.0;
            let coloured: Vec<f64> = errors(2401)
                .into_iter()
                .map(|e| {
                    last = coefficient * last + e;
                    last
                })
                .collect();
            assert_eq!(tested(&coloured), None, "{coefficient}");
        }
    }
}
