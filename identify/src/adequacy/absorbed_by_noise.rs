//! Structure that passes for the noise's memory.
//!
//! An autoregression foretells a slow error, whatever its cause, as well as it foretells slow noise: whitened, nothing is
//! left of it. Three things give it away. Noise with a memory forgets within the record, so that its means over long parts
//! are small beside itself; its memory is the same in both halves of the record; and it has no line in its spectrum:
//!
//! ```text
//! slow    = mean_k(mean_k^2) / mean(e^2)                             over PARTS parts of the record
//! changed = sum_halves rows/2 ln(var(e whitened by the other half's memory) / var(e whitened by its own))     [nats]
//! alone   = max_f(power(f) / mean power of the frequencies around f)
//! ```
//!
//! 1/f noise, the slowest that a sensor has, stays below 0.6 and 40 nats in 2400 rows; so does a first-order
//! autoregression with a coefficient of 0.99.

use crate::adequacy::localisation::whereabouts;
use crate::adequacy::unmodelled::Leftover;
use crate::noise::autocorrelation::Autocorrelation;
use crate::record::data::Data;
use crate::record::spectrum;
use crate::stats::scale::{robust_scale, root_mean_square};

/// Long parts of the record.
const PARTS: usize = 8;
/// Shorter records cannot tell.
const FEWEST_ROWS: usize = 10 * PARTS;
/// More than this part of the square in the means of the parts is no noise.
const SLOW: f64 = 0.75;
/// A memory that changes by so much, in nats and in nats a row, is none.
const CHANGED: f64 = 60.0;
const CHANGED_PER_ROW: f64 = 0.02;
/// A line that is so many times as strong as its neighbours is none either.
const ALONE: f64 = 30.0;
/// Errors beyond so many scales do not count.
const CLIP: f64 = 4.0;

/// Tests what a model leaves, where that has a memory.
pub fn test(data: &Data, errors: &[f64], memory: &Autocorrelation) -> Option<Leftover> {
    if errors.len() < FEWEST_ROWS || memory.is_white() {
        return None;
    }
    let found = |place: &str, share: f64| Leftover {
        place: place.to_owned() + &whereabouts(data, errors),
        share,
        rms: share.sqrt() * root_mean_square(errors),
        significant: true,
        doubtful: true,
    };
    let slow = slow(errors);
    if slow > SLOW {
        return Some(found("as a slow swing over the whole record", slow));
    }
    let changed = changed(errors);
    if changed > CHANGED.max(CHANGED_PER_ROW * errors.len() as f64) {
        let new = root_mean_square(&memory.whitened(errors)) / root_mean_square(errors);
        return Some(found("as a rhythm that changes along the record", (1.0 - new * new).max(0.0)));
    }
    let line = spectrum::most_prominent_line(errors, data).filter(|line| line.prominence > ALONE)?;
    Some(found(&format!("at a frequency of {:.3} Hz", line.frequency_hz), line.share))
}

fn slow(errors: &[f64]) -> f64 {
    let parts = errors.chunks_exact(errors.len() / PARTS).take(PARTS);
    let means = parts.map(|part| (part.iter().sum::<f64>() / part.len() as f64).powi(2));
    means.sum::<f64>() / PARTS as f64 / root_mean_square(errors).powi(2)
}

fn changed(errors: &[f64]) -> f64 {
    let (early, late) = errors.split_at(errors.len() / 2);
    let [of_early, of_late] = [early, late].map(|half| Autocorrelation::fitted(half, robust_scale(half)));
    let loss = |half: &[f64], own: &Autocorrelation, other: &Autocorrelation| {
        let own = own.whitened(half);
        let bound = CLIP * robust_scale(&own);
        let size =
            |white: Vec<f64>| root_mean_square(&white.iter().map(|e| e.clamp(-bound, bound)).collect::<Vec<_>>());
        half.len() as f64 * (size(other.whitened(half)) / size(own)).ln()
    };
    loss(early, &of_early, &of_late) + loss(late, &of_late, &of_early)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::data::Input;
    use simulation::record::{Record, Row};

    /// Independent errors of unit variance, nearly normal.
    fn errors(rows: usize) -> Vec<f64> {
        let mut state = 7u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..rows).map(|_| (0..12).map(|_| uniform()).sum()).collect()
    }

    fn verdict(of_row: impl Fn(f64) -> f64) -> Option<String> {
        let errors: Vec<f64> =
            errors(2401).iter().enumerate().map(|(row, e)| e + of_row(row as f64 / 2401.0)).collect();
        tested(&errors).map(|found| found.place)
    }

    fn tested(errors: &[f64]) -> Option<Leftover> {
        let row = |row: usize| Row { line: row, time_s: 0.1 * row as f64, voltage_v: 0.0, measured: Some(0.0) };
        let record = Record { name: String::new(), rows: (0..errors.len()).map(row).collect() };
        test(&Data::new(&record, Input::Hold), errors, &Autocorrelation::fitted(errors, robust_scale(errors)))
    }

    #[test]
    fn slow_errors_and_changing_rhythms_are_no_noise() {
        use std::f64::consts::{PI, TAU};
        for slow in [verdict(|t| 20.0 * (PI * t).sin()), verdict(|t| 30.0 * (-6.0 * t).exp()), verdict(|_| 20.0)] {
            assert!(slow.as_ref().is_some_and(|place| place.contains("slow swing")), "{slow:?}");
        }
        let chirp = verdict(|t| 10.0 * (TAU * (2.4 * t + 30.0 * t * t)).sin());
        let line = verdict(|t| 4.0 * (TAU * 300.3 * t).sin());
        assert!(line.as_ref().is_some_and(|place| place.contains("1.251 Hz")), "{line:?}");
        assert!(chirp.as_ref().is_some_and(|place| place.contains("rhythm")), "{chirp:?}");
    }

    #[test]
    fn noise_with_a_memory_is_noise() {
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
