//! The stiffness sensor's settings, in SI units, and its readings.

use crate::error::OutOfRange;
use crate::units::{SampleTime, ScaledStiffness, lag_fraction};
use crate::validated::Validate;

/// Number of ticks for which the model's stiffness is kept, so that late readings can be compared with it.
pub const HISTORY: usize = 32;

/// A stiffness sensor and how its readings correct the model, in SI units.
///
/// ```
/// use model::{Feedback, Input, OutOfRange, Reading, ScaledStiffness, Sensor, Settings, State, Volts};
///
/// fn main() -> Result<(), OutOfRange> {
///     let settings = Settings { feedback: Some(Feedback::TYPICAL), ..Settings::PAPER };
///     let config = settings.validate()?.quantize();
///     let (mut state, mut last) = (State::default(), ScaledStiffness::default());
///     let mut noise = [Volts::new(0.1)?, Volts::new(-0.1)?].into_iter().cycle();
///     let mut output = None;
///     for _ in 0..30_000 {
///         // A real spring that is 4 V stiffer than the model, read with a noise of 0.1 V.
///         let read = last.0 - state.correction().0 + Volts::new(4.0)?.0 + noise.next().unwrap().0;
///         let input = Input { target: Volts::new(300.0)?, measured: Reading::fresh(ScaledStiffness(read)) };
///         let tick = config.tick(&mut state, input);
///         (last, output) = (tick.stiffness, Some(tick));
///     }
///     assert_eq!(output.unwrap().sensor, Some(Sensor::Trusted));
///     assert!((state.correction().to_f64() - 4.0).abs() < 0.1);
///     assert!((last.to_f64() - 300.0).abs() < 0.5);
///     Ok(())
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feedback {
    /// Standard deviation of one reading including its rounding, 0.001 to 100 V; at least half of the step to which the
    /// sensor rounds.
    pub noise_v: f64,
    /// Standard deviation with which the model's error wanders, 0.001 to 1000 V per root second.
    pub model_uncertainty: f64,
    /// Shortest time constant of the correction, 0 to 100 s; at least `e` times an unknown delay, and
    /// `1 / (2 zeta omega)` of an unknown mode.
    pub fastest_s: f64,
    /// Time between two readings, one sample time to 0.1 s.
    pub interval_s: f64,
    /// Age above which a reading is stale, 0 to 31 sample times, in s.
    pub oldest_s: f64,
    /// Lowest value that the sensor can give, -1000 to 990 V. A reading below it is a fault.
    pub lowest_v: f64,
    /// Highest value that the sensor can give, `lowest_v` + 1 V to 1000 V. A reading above it is a fault.
    pub highest_v: f64,
    /// Time constant with which the correction decays while the sensor is not trusted, two sample times to 100 s.
    pub fade_s: f64,
}

impl Feedback {
    /// A sensor of 1 V noise that is read at 1 kHz, for a model whose error wanders by 1 V in a second.
    pub const TYPICAL: Self = Self {
        noise_v: 1.0,
        model_uncertainty: 1.0,
        fastest_s: 0.1,
        interval_s: 1e-3,
        oldest_s: 0.01,
        lowest_v: -50.0,
        highest_v: 1000.0,
        fade_s: 2.0,
    };

    /// Returns the settings with these values, in the order of the fields, to be validated. `None` where the crate is built
    /// without the feature `feedback`.
    pub const fn from_values(values: [f64; 8]) -> Option<Self> {
        let [noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s] = values;
        Some(Self { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s })
    }

    /// Returns the settings in the order of their fields.
    pub const fn values(&self) -> [f64; 8] {
        let Self { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s } = *self;
        [noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s]
    }

    /// Returns the fraction of an innovation that one reading adds to the correction, below 1/2: the Kalman gain,
    /// reduced as far as [`fastest_s`](Self::fastest_s) demands.
    pub fn gain(&self) -> f64 {
        let ratio = self.model_uncertainty / self.noise_v;
        let rho = ratio * ratio * self.interval_s;
        // Newton's method for the root of L^2 + rho L - rho, from above: a square root would take 0.7 KB of flash.
        let kalman = (0..40).fold(1.0, |gain, _| (gain * gain + rho) / (2.0 * gain + rho));
        let most = if self.fastest_s > 0.0 { lag_fraction(self.interval_s, self.fastest_s) } else { 1.0 };
        kalman.min(most).min(0.499)
    }
}

impl Validate for Feedback {
    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        let Self { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s } = *self;
        let seconds = sample_time.seconds();
        OutOfRange::check("noise_v", noise_v, 0.001..=100.0, "V")?;
        OutOfRange::check("model_uncertainty", model_uncertainty, 0.001..=1000.0, "V per root second")?;
        OutOfRange::check("fastest_s", fastest_s, 0.0..=100.0, "s")?;
        OutOfRange::check("interval_s", interval_s, seconds..=0.1, "s")?;
        OutOfRange::check("oldest_s", oldest_s, 0.0..=(HISTORY - 1) as f64 * seconds, "s")?;
        OutOfRange::check("lowest_v", lowest_v, -1000.0..=990.0, "V")?;
        OutOfRange::check("highest_v", highest_v, lowest_v + 1.0..=1000.0, "V")?;
        OutOfRange::check("fade_s", fade_s, 2.0 * seconds..=100.0, "s")
    }
}

/// Latest value of the stiffness sensor, and its age.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Measured stiffness, expressed as the equivalent static voltage.
    pub stiffness: ScaledStiffness,
    /// Whole ticks since the sensor sampled; 0 if it sampled after the last tick's voltage was applied. The same sample
    /// may be passed again as it ages.
    pub age: u16,
}

impl Reading {
    /// Returns a reading of age 0: sampled after the last tick's voltage was applied. `None` where the crate is built
    /// without the feature `feedback`.
    pub fn fresh(stiffness: ScaledStiffness) -> Option<Self> {
        Some(Self { stiffness, age: 0 })
    }
}

#[cfg(test)]
mod tests;
