//! Random effect values of size 1, cause by cause: clearly visible in noise of 0.2 % of 500 V.
//!
//! | cause | values at size 1 |
//! | --- | --- |
//! | gain error | 3 to 15 % above or below 1 |
//! | instantaneous share | 0.02 to 0.06, or 0.13 to 0.25 |
//! | time constant | 2.5 to 4.7 s, or 6.5 to 10 s |
//! | second relaxation | share 0.06 to 0.25, 15 s to a third of the record (at most 90 s) |
//! | voltage-dependent time constant | 5.5 s times 0.55 to 0.85 at one end, times 1.2 to 1.8 at the other |
//! | static nonlinearity | 12 to 45 V off the straight line at 250 V |
//! | hysteresis | 25 to 80 V wide |
//! | charge leakage | share 0.08 to 0.3, 12 s to a third of the record (at most 60 s) |
//! | drift | 5 to 20 % over the record, either way |
//! | resonance | 0.04 to 0.25 of the sampling rate but at least 0.3 Hz, zeta 0.03 to 0.2 |
//! | delay | 1.2 to 6 rows, at least 0.05 s; or 1 to 6 whole rows (less 1 ns, so that rounding has no influence) |
//! | amplifier limit | 60 to 93 % of full scale |
//! | amplifier slew | 100 V take 3 to 15 rows |
//! | sensor saturation | at 60 to 93 % of the largest stiffness |
//! | quantisation | 7 to 20 V |
//! | hum | 3.5 to 10 V, 0.3 Hz to 0.4 of the sampling rate |
//! | reading offset | 5 to 20 V over 5 to 25 % of the record |
//! | outliers | 0.5 to 3 % of the readings, 15 to 60 standard deviations of the noise off |
//! | series lag | 2 rows, at least 0.15 s, to 3 s |
//!
//! Frequencies stay below half of the sampling rate and time constants below the record's length, so that each can be
//! identified.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::cause::Cause;
use super::effect::{Effect, neutral};
use super::physics::TAU_S;
use super::schedule::Schedule;

impl Effect {
    /// A random effect of size 1 in the given form; `sigma_v` is the standard deviation of the noise, in V.
    pub fn draw(random: &mut ChaCha8Rng, cause: Cause, form: usize, schedule: &Schedule, sigma_v: f64) -> Self {
        assert!(form < cause.facts().forms.len(), "{cause} has no form {form}");
        let (duration, every, full_v) = (schedule.duration_s(), schedule.every_s(), schedule.full_v());
        let none = neutral(cause);
        let mut between = |low: f64, high: f64| random.random_range(low..high);
        // Index and neutral value of the values that scale with the size; by default the first.
        let mut shrinking = vec![(0, none)];
        let full_size = match cause {
            Cause::GainError => vec![1.0 + signed(&mut between, 0.03, 0.15)],
            Cause::InstantaneousShare if between(0.0, 1.0) < 0.5 => vec![between(0.02, 0.06)],
            Cause::InstantaneousShare => vec![between(0.13, 0.25)],
            Cause::TimeConstant if between(0.0, 1.0) < 0.5 => vec![between(2.5, 4.7)],
            Cause::TimeConstant => vec![between(6.5, 10.0)],
            Cause::SecondRelaxation => vec![between(0.06, 0.25), between(15.0, (duration / 3.0).clamp(16.0, 90.0))],
            Cause::VoltageDependentTimeConstant => {
                shrinking.push((1, none));
                let mut ends = vec![TAU_S * between(0.55, 0.85), TAU_S * between(1.2, 1.8)];
                if between(0.0, 1.0) < 0.5 {
                    ends.reverse();
                }
                ends
            }
            Cause::StaticNonlinearity => vec![signed(&mut between, 0.1, 0.36)],
            Cause::Hysteresis => vec![between(25.0, 80.0)],
            Cause::ChargeLeakage => vec![between(0.08, 0.3), between(12.0, (duration / 3.0).clamp(14.0, 60.0))],
            Cause::Drift => vec![signed(&mut between, 0.05, 0.2) / duration],
            Cause::Resonance => {
                shrinking = vec![(2, 0.0)];
                let lowest = (0.04 / every).max(0.3);
                vec![between(lowest, (0.25 / every).max(1.2 * lowest)), between(0.03, 0.2), 1.0]
            }
            Cause::Delay if between(0.0, 1.0) < 0.5 => vec![every * between(0.5, 6.5).round() - 1e-9],
            Cause::Delay => vec![(every * between(1.2, 6.0)).max(0.05)],
            Cause::AmplifierLimit => {
                shrinking = vec![(0, full_v)];
                vec![full_v * between(0.6, 0.93)]
            }
            Cause::AmplifierSlew => vec![every * between(3.0, 15.0) / 100.0],
            Cause::SensorSaturation => {
                shrinking = vec![(0, 1.0)];
                vec![between(0.6, 0.93)]
            }
            Cause::Quantisation => vec![between(7.0, 20.0)],
            Cause::Hum => {
                let fastest = (0.4 / every).max(0.6);
                let freq_hz = 0.3 * (fastest / 0.3).powf(between(0.0, 1.0));
                vec![between(3.5, 10.0), freq_hz, between(0.0, std::f64::consts::TAU)]
            }
            Cause::ReadingOffset => {
                shrinking = vec![(2, 0.0)];
                let length = between(0.05, 0.25);
                let from = between(0.03, 0.97 - length);
                vec![duration * from, duration * (from + length), signed(&mut between, 5.0, 20.0)]
            }
            Cause::Outliers => {
                shrinking = vec![(1, 0.0)];
                vec![between(0.005, 0.03), sigma_v * between(15.0, 60.0)]
            }
            Cause::SeriesLag => {
                let shortest = (2.0 * every).max(0.15);
                vec![shortest * (3.0 / shortest).powf(between(0.0, 1.0))]
            }
        };
        let mut at_rest = full_size.clone();
        for (index, value) in shrinking {
            at_rest[index] = value;
        }
        Self { cause, form, full_size, neutral: at_rest, size: 1.0 }
    }
}

/// A random number between `low` and `high` with random sign.
fn signed(between: &mut impl FnMut(f64, f64) -> f64, low: f64, high: f64) -> f64 {
    let sign = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
    sign * between(low, high)
}
