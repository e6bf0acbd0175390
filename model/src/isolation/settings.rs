//! The bank's settings, in SI units.

use super::{Cause, bank, thresholds};
use crate::error::OutOfRange;
use crate::estimator::Plant;
use crate::units::SampleTime;
use crate::validated::Validate;

/// Errors of the stored model that are no fault, both ways: half the widths of the 95 % intervals of its parameters, each 0 to 0.25.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tolerance {
    /// Relative error of the time constant.
    pub time_constant: f64,
    /// Relative error of the instantaneous share.
    pub share: f64,
    /// Relative error of the gain.
    pub gain: f64,
}

impl Tolerance {
    /// The model is exact: each error of it is a fault.
    pub const NONE: Self = Self { time_constant: 0.0, share: 0.0, gain: 0.0 };

    /// The values in the order of the fields: time constant, share, gain.
    pub const fn values(&self) -> [f64; 3] {
        [self.time_constant, self.share, self.gain]
    }

    /// A tolerance with these values, in the order of [`Tolerance::values`].
    pub const fn from_values([time_constant, share, gain]: [f64; 3]) -> Self {
        Self { time_constant, share, gain }
    }

    /// Checks that each error is within 0 to 0.25.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let names = ["tolerance.time_constant", "tolerance.share", "tolerance.gain"];
        let mut errors = names.into_iter().zip(self.values());
        errors.try_for_each(|(name, error)| OutOfRange::check(name, error, 0.0..=0.25, "of the model's"))
    }
}

/// A bank of residual signatures for one spring and one stiffness sensor, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The spring that the tick's estimator runs; the signatures are its sensitivities.
    pub plant: Plant,
    /// Standard deviation of one reading, 0.05 to 100 V.
    pub noise_v: f64,
    /// Time between two readings, one sample time to half a block.
    pub interval_s: f64,
    /// Correlation time of the readings' noise, 0 for white noise, to 10 s. It whitens the residual to first order.
    pub noise_correlation_s: f64,
    /// Highest voltage of the amplifier, 50 to 1000 V: the scale of the laws and limits.
    pub range_v: f64,
    /// Logarithm of the mean number of blocks between false alarms, 5 to 40 nats: threshold of the sequential tests.
    pub alarm_nats: f64,
    /// Difference of log-likelihood below which two causes are not distinguished, 1 to 100 nats.
    pub margin_nats: f64,
    /// Errors of `plant` that raise no alarm; none by default.
    pub tolerance: Tolerance,
}

impl Settings {
    /// The source report's spring and range, and a sensor of 1 V noise that is read at 1 kHz.
    pub const PAPER: Self = Self {
        plant: Plant::PAPER,
        noise_v: 1.0,
        interval_s: 1e-3,
        noise_correlation_s: 0.0,
        range_v: 700.0,
        alarm_nats: 20.0,
        margin_nats: 10.0,
        tolerance: Tolerance::NONE,
    };

    /// Returns the factor from the coefficient of a cause's principal vector to its size in the unit of [`Cause`], for ticks of
    /// `rate_hz`.
    pub fn unit(&self, cause: Cause, rate_hz: f64) -> f64 {
        let block_s = bank::block_s(rate_hz);
        match cause {
            Cause::Hysteresis | Cause::StaticNonlinearity | Cause::AmplifierLimit => self.range_v,
            Cause::AmplifierSlew => block_s / self.range_v,
            Cause::Delay | Cause::SeriesLag => block_s,
            Cause::Drift => 1.0 / (f64::from(bank::MOST_BLOCKS) * block_s),
            _ => 1.0,
        }
    }

    /// Returns the number of readings in a block of `block_s` s, at least 1.
    pub fn readings(&self, block_s: f64) -> u32 {
        libm::rint(block_s / self.interval_s).max(1.0) as u32
    }

    /// Returns the standard deviation of the readings' mean over a block of `block_s` s, in V, and the correlation of
    /// neighbouring blocks.
    pub fn block_noise(&self, block_s: f64) -> (f64, f64) {
        let readings = self.readings(block_s);
        let count = f64::from(readings);
        // 0 for white noise.
        let next = libm::exp(-self.interval_s / libm::fabs(self.noise_correlation_s));
        let (mut own, mut neighbour, mut power) = (count, 0.0, 1.0);
        for lag in 1..2 * readings {
            power *= next;
            own += 2.0 * f64::from(readings.saturating_sub(lag)) * power;
            neighbour += (count - libm::fabs(count - f64::from(lag))) * power;
        }
        (self.noise_v * libm::sqrt(own) / count, neighbour / own)
    }
}

impl Validate for Settings {
    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        self.plant.check(sample_time)?;
        let rate_hz = 1.0 / sample_time.seconds();
        let block_s = f64::from(bank::block_ticks(rate_hz)) * sample_time.seconds();
        // A low-pass covers less than half of its distance in one block.
        OutOfRange::check("plant.time_constant_s", self.plant.time_constant_s, 2.0 * block_s..=1000.0, "s")?;
        OutOfRange::check("noise_v", self.noise_v, 0.05..=100.0, "V")?;
        OutOfRange::check("interval_s", self.interval_s, sample_time.seconds()..=0.5 * block_s, "s")?;
        OutOfRange::check("noise_correlation_s", self.noise_correlation_s, 0.0..=10.0, "s")?;
        OutOfRange::check("range_v", self.range_v, 50.0..=1000.0, "V")?;
        OutOfRange::check("alarm_nats", self.alarm_nats, thresholds::RESTART_NATS..=40.0, "nats")?;
        OutOfRange::check("margin_nats", self.margin_nats, 1.0..=100.0, "nats")?;
        self.tolerance.check()
    }
}
