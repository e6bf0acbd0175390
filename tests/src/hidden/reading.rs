//! From stiffness to file: offset, hum, noise and outliers add up, the sensor clips the sum, the file rounds it.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::cause::Cause;
use super::effect::Effect;
use super::schedule::Schedule;

/// What ends up in the file, and what of it could have been foretold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings {
    /// Noise and all, in V.
    pub read: Vec<f64>,
    /// Without noise, outliers and rounding, in V.
    pub expected: Vec<f64>,
    /// The sensor's bound, in V.
    pub limit: Option<f64>,
    /// How many readings are outliers.
    pub outliers: usize,
}

impl Readings {
    /// Of a stiffness, with noise (in V) and those of the effects that touch readings.
    pub fn of(
        stiffness: Vec<f64>,
        noise: &[f64],
        schedule: &Schedule,
        effects: &[Effect],
        random: &mut ChaCha8Rng,
    ) -> Self {
        let top = stiffness.iter().copied().fold(0.0, f64::max);
        let mut expected = stiffness;
        let mut extra = noise.to_vec();
        let (mut limit, mut step, mut outliers) = (None, None, 0);
        for effect in effects.iter().filter(|effect| effect.size > 0.0) {
            match (effect.cause, effect.values().as_slice()) {
                (Cause::ReadingOffset, &[from_s, to_s, offset]) => {
                    for (y, &t) in expected.iter_mut().zip(&schedule.time_s) {
                        *y += if (from_s..=to_s).contains(&t) { offset } else { 0.0 };
                    }
                }
                (Cause::Hum, &[amplitude, freq_hz, phase]) => {
                    for (y, &t) in expected.iter_mut().zip(&schedule.time_s) {
                        *y += amplitude * (std::f64::consts::TAU * freq_hz * t + phase).sin();
                    }
                }
                (Cause::Outliers, &[fraction, typical_v]) => {
                    for e in &mut extra {
                        // As many draws whatever the outcome: the same readings are hit at every size.
                        let (hit, far, down) =
                            (random.random_bool(fraction), random.random_range(0.5..1.5), random.random_bool(0.5));
                        if hit {
                            *e += if down && effect.form == 0 { -typical_v * far } else { typical_v * far };
                            outliers += 1;
                        }
                    }
                }
                (Cause::SensorSaturation, &[part]) => limit = Some(part * top),
                (Cause::Quantisation, &[volts]) => step = Some(volts),
                _ => {}
            }
        }
        let bound = limit.unwrap_or(f64::INFINITY);
        let rounded = |y: f64| step.map_or(y, |step| (y / step).round() * step);
        let read = expected.iter().zip(extra).map(|(y, e)| rounded((y + e).min(bound))).collect();
        expected.iter_mut().for_each(|y| *y = y.min(bound));
        Self { read, expected, limit, outliers }
    }
}
