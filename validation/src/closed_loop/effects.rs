//! Every effect in closed loop, with a sensor and without.

use model::{OutOfRange, Sensor, Settings};
use rayon::prelude::*;

use super::scenario::{Sample, Scenario, fresh};
use super::stair::{self, Step};
use crate::ground_truth::Cause;
use crate::statistics::median;

/// Effects whose steady error a sensor has to correct to within the noise of one reading.
pub const CORRECTED: [Cause; 6] = [
    Cause::GainError,
    Cause::StaticNonlinearity,
    Cause::Hysteresis,
    Cause::SecondRelaxation,
    Cause::ChargeLeakage,
    Cause::Drift,
];

/// Figures of one effect over all its seeds.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Cause of the effect; `None` for the paper's spring.
    pub cause: Option<Cause>,
    /// Figures without a sensor.
    pub without: Figures,
    /// Figures with a sensor.
    pub with: Figures,
    /// Fraction of the time in which the sensor was trusted.
    pub trusted: f64,
}

/// Figures over all steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Root mean square of the steady errors, in V.
    pub steady_v: f64,
    /// Median time to 97 % over the steps of 100 V upward, in s; `None` if most of them do not reach 97 %.
    pub t97_s: Option<f64>,
    /// Largest overshoot of these steps, in percent.
    pub overshoot_percent: f64,
}

/// Runs the paper's spring and every effect.
///
/// # Errors
/// The model rejects the settings.
pub fn all(settings: &Settings, seeds: u64, first_seed: u64) -> Result<Vec<Outcome>, OutOfRange> {
    let causes: Vec<_> = std::iter::once(None).chain(Cause::ALL.map(Some)).collect();
    causes.par_iter().map(|&cause| one(settings, cause, first_seed..first_seed + seeds)).collect()
}

/// Runs one effect; `None` is the paper's spring.
///
/// # Errors
/// The model rejects the settings.
pub fn one(settings: &Settings, cause: Option<Cause>, seeds: std::ops::Range<u64>) -> Result<Outcome, OutOfRange> {
    let alone = Settings { feedback: None, ..*settings };
    let (mut without, mut with, mut trusted) = (Vec::new(), Vec::new(), 0);
    let mut ticks = 0;
    for seed in seeds {
        let scenario = cause.map_or_else(|| Scenario::nothing(seed), |cause| Scenario::of(cause, seed));
        without.extend(steps(&scenario.run(&alone, |_, _| None)?, settings.rate_hz));
        let run = scenario.run(settings, |_, read| fresh(read))?;
        with.extend(steps(&run, settings.rate_hz));
        trusted += run.iter().filter(|sample| sample.sensor == Some(Sensor::Trusted)).count();
        ticks += run.len();
    }
    let trusted = trusted as f64 / ticks as f64;
    Ok(Outcome { cause, without: Figures::of(&without), with: Figures::of(&with), trusted })
}

fn steps(run: &[Sample], rate_hz: f64) -> Vec<Step> {
    stair::steps(&run.iter().map(|sample| sample.truth).collect::<Vec<_>>(), rate_hz)
}

impl Figures {
    fn of(steps: &[Step]) -> Self {
        let mean_square = steps.iter().map(|step| step.steady_v.powi(2)).sum::<f64>() / steps.len() as f64;
        let up: Vec<_> = steps.iter().filter(|step| step.up).collect();
        let times: Vec<f64> = up.iter().map(|step| step.t97_s.unwrap_or(f64::INFINITY)).collect();
        Self {
            steady_v: mean_square.sqrt(),
            t97_s: median(&times).filter(|time| time.is_finite()),
            overshoot_percent: up.iter().map(|step| step.overshoot_percent).fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Amplifier, Approach, Compensation, Feedback};

    #[test]
    fn a_sensor_corrects_the_steady_error_of_a_wrong_model_to_the_noise() {
        let fast = Settings {
            compensation: Compensation::TimeOptimal(Approach::DEAD_BEAT),
            amplifier: Amplifier::up_to(1000.0),
            feedback: Some(Feedback::TYPICAL),
            ..Settings::PAPER
        };
        let noise_v = Feedback::TYPICAL.noise_v;
        for cause in CORRECTED {
            let Outcome { without, with, trusted, .. } = one(&fast, Some(cause), 21..22).unwrap();
            assert!(without.steady_v > 3.0 * noise_v, "{cause} has no effect: {without:?}");
            assert!(with.steady_v < noise_v, "{cause}: {with:?}, without {without:?}");
            assert!(trusted > 0.99, "{cause} is mistaken for a fault of the sensor: {trusted}");
        }
        // The correction must not overcompensate a delay nor excite a resonance.
        for cause in [Cause::Resonance, Cause::Delay] {
            let Outcome { without, with, .. } = one(&fast, Some(cause), 21..22).unwrap();
            assert!(with.steady_v < noise_v, "{cause}: {with:?}");
            assert!(
                with.overshoot_percent < without.overshoot_percent + 20.0,
                "{cause}: {with:?}, without {without:?}"
            );
        }
    }
}
