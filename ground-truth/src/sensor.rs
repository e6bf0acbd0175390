//! From stiffness to reading: offset, hum, noise and outliers are added, the sensor clips the sum, the file rounds it.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::cause::Cause;
use super::effect::Effect;
use super::schedule::Schedule;

/// Sensor with the effects that act on readings.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Effects that are added to a reading.
    effects: Vec<Effect>,
    /// Largest reading, in V.
    limit: Option<f64>,
    /// Step of the quantisation, in V.
    step: Option<f64>,
}

/// One reading of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Value in the file, in V.
    pub read: f64,
    /// Value without noise, outliers and rounding, in V.
    pub expected: f64,
    /// True if the reading is an outlier.
    pub outlier: bool,
}

impl Sensor {
    /// Sensor with those of the effects that act on readings; `top` is the largest stiffness that it will see, in V.
    pub fn new(effects: &[Effect], top: f64) -> Self {
        let mut sensor = Self { effects: Vec::new(), limit: None, step: None };
        for effect in effects.iter().filter(|effect| effect.size > 0.0) {
            match (effect.cause, effect.values().as_slice()) {
                (Cause::ReadingOffset | Cause::Hum | Cause::Outliers, _) => sensor.effects.push(effect.clone()),
                (Cause::SensorSaturation, &[part]) => sensor.limit = Some(part * top),
                (Cause::Quantisation, &[volts]) => sensor.step = Some(volts),
                _ => {}
            }
        }
        sensor
    }

    /// Reads a `stiffness`, in V, at time `t`, in s, with `noise`, in V, added to it.
    pub fn read(&self, stiffness: f64, t: f64, noise: f64, random: &mut ChaCha8Rng) -> Reading {
        let (mut expected, mut extra, mut outlier) = (stiffness, noise, false);
        for effect in &self.effects {
            match (effect.cause, effect.values().as_slice()) {
                (Cause::ReadingOffset, &[from_s, to_s, offset]) => {
                    expected += if (from_s..=to_s).contains(&t) { offset } else { 0.0 };
                }
                (Cause::Hum, &[amplitude, freq_hz, phase]) => {
                    expected += amplitude * (std::f64::consts::TAU * freq_hz * t + phase).sin();
                }
                (Cause::Outliers, &[fraction, typical_v]) => {
                    // The number of draws does not depend on the outcome: the same readings are outliers at every size.
                    let (hit, far, down) =
                        (random.random_bool(fraction), random.random_range(0.5..1.5), random.random_bool(0.5));
                    if hit {
                        extra += if down && effect.form == 0 { -typical_v * far } else { typical_v * far };
                        outlier = true;
                    }
                }
                _ => {}
            }
        }
        let bound = self.limit.unwrap_or(f64::INFINITY);
        let rounded = |y: f64| self.step.map_or(y, |step| (y / step).round() * step);
        Reading { read: rounded((expected + extra).min(bound)), expected: expected.min(bound), outlier }
    }
}

/// Readings of a record, row by row, with their noise-free values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings {
    /// Values in the file, in V.
    pub read: Vec<f64>,
    /// Values without noise, outliers and rounding, in V.
    pub expected: Vec<f64>,
    /// Largest reading of a saturating sensor, in V.
    pub limit: Option<f64>,
    /// Number of outliers.
    pub outliers: usize,
}

impl Readings {
    /// Reads a stiffness, row by row, with noise (both in V) and those of the effects that act on readings.
    pub fn of(
        stiffness: Vec<f64>,
        noise: &[f64],
        schedule: &Schedule,
        effects: &[Effect],
        random: &mut ChaCha8Rng,
    ) -> Self {
        let sensor = Sensor::new(effects, stiffness.iter().copied().fold(0.0, f64::max));
        let mut readings = Self { limit: sensor.limit, ..Self::default() };
        for ((y, &t), &noise) in stiffness.into_iter().zip(&schedule.time_s).zip(noise) {
            let Reading { read, expected, outlier } = sensor.read(y, t, noise, random);
            readings.read.push(read);
            readings.expected.push(expected);
            readings.outliers += usize::from(outlier);
        }
        readings
    }
}
