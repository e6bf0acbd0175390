//! Adaptation: parameters of the plain spring that the isolation bank has named are taken over by the running model.
//!
//! Important terms:
//!
//! - *stored model*: the spring of the settings, with which every run begins.
//! - *parameters*: gain, time constant and share of the running model as ratios to the stored one ([`Parameters`]).
//! - *observation*: what the bank, the sensor and the voltage have shown by the end of a block ([`Observation`]).
//! - *exchange*: the tick in which the configuration of the next parameters replaces the running one ([`Variant`]).
//! - *trial*: the time from a takeover until the bank has had time to name an error and is quiet.
//!
//! ```text
//! tick -> Watch -> (block) -> Observation -> State::update -> Parameters -> Variant -> exchange at the end of the next block
//!         fixed point                        floating point, outside of the tick
//! ```
//!
//! - **What is taken over.** Gain, time constant and share, when the bank names one of them alone, and the noise leaves it a 95 % interval that is
//!   narrow enough ([`Settings::precision`]), while the sensor was trusted since the fault began and the voltage has moved far enough since
//!   ([`Settings::excitation`]). The size is that of a linear signature; what it leaves is named again and taken over in turn.
//! - **Bounds.** No parameter leaves its range around the stored model. It moves by at most [`Settings::rate_per_s`], in steps of one
//!   block, and only where the estimate is near the target and no limit acts.
//! - **Bumpless.** In an exchange the estimate and the voltage stay: the sensor's correction takes up the difference of the models, and
//!   the pre-compensator is preset ([`crate::Config::take_over`]).
//! - **Reversible.** A takeover is confirmed once the bank was quiet for the time that it needs to name an error, while the voltage
//!   moved. If it names a fault of the sensor or none that it knows before that, or the same cause with a size that has not halved, or
//!   if a parameter is at its bound, the model goes back to the last confirmed parameters (to the stored ones from a bound) and stays
//!   there until [`State::switch`] is called. The same function switches the adaptation off: the model goes back to the stored one.
//! - **Gain.** The plain spring has none. The loop runs on stiffness divided by the gain: target and reading are divided before the
//!   tick, the estimate is multiplied after it ([`Scale`]).
//!
//! A sensor whose own gain is wrong looks like a spring whose gain is: within its bound the gain follows.

mod state;
mod variant;
mod watch;

pub use state::{Phase, State};
pub use variant::{Scale, Variant};
pub use watch::{Observation, Watch, settled_within};

use crate::controller;
use crate::error::OutOfRange;
use crate::estimator::Plant;
use crate::isolation::{self, Cause};
use crate::units::SampleTime;
use crate::validated::Validate;

/// Bounds and conditions of the adaptation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Largest relative deviation of the time constant from the stored one, both ways, 0 to 0.5: the 95 % interval of the plant.
    pub time_constant: f64,
    /// Largest relative deviation of the share from the stored one, both ways, 0 to 0.5.
    pub share: f64,
    /// Largest relative deviation of the gain from 1, both ways, 0 to 0.5.
    pub gain: f64,
    /// Largest relative change of a parameter in a second, 0.001 to 1.
    pub rate_per_s: f64,
    /// Largest half width of the 95 % interval that the noise leaves a parameter that is taken over, relative to it, 0.0001 to 0.1.
    pub precision: f64,
    /// Distance between the lowest and the highest voltage since the fault began, as a part of the amplifier's range, 0.01 to 1.
    pub excitation: f64,
}

/// Parameters of a spring as ratios to those of the stored model; without a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Ratio of the time constants.
    pub time_constant: f64,
    /// Ratio of the shares.
    pub share: f64,
    /// Gain of the whole response; the stored model's is 1.
    pub gain: f64,
}

impl Settings {
    /// Time constant and share within 25 %, the gain within 15 %; 5 % in a second; intervals of 1 %; a tenth of the range.
    pub const TYPICAL: Self =
        Self { time_constant: 0.25, share: 0.25, gain: 0.15, rate_per_s: 0.05, precision: 0.01, excitation: 0.1 };

    /// The values in the order of the fields: time constant, share, gain, rate, precision, excitation.
    pub const fn values(&self) -> [f64; 6] {
        [self.time_constant, self.share, self.gain, self.rate_per_s, self.precision, self.excitation]
    }

    /// Settings with these values, in the order of [`Settings::values`].
    pub const fn from_values(values: [f64; 6]) -> Self {
        let [time_constant, share, gain, rate_per_s, precision, excitation] = values;
        Self { time_constant, share, gain, rate_per_s, precision, excitation }
    }

    /// Checks that the springs at both ends of the bounds can be run in place of the one that `control` and `bank` have.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field that does not allow it.
    pub fn check_for(&self, control: &controller::Settings, bank: &isolation::Settings) -> Result<(), OutOfRange> {
        let (low, high) = self.bounds();
        let sample_time = SampleTime::from_rate(control.rate_hz)?;
        [(low, low), (low, high), (high, low), (high, high)].iter().try_for_each(|(one, other)| {
            let plant = Parameters { share: other.share, ..*one }.applied_to(control.plant);
            controller::Settings { plant, ..*control }.validate()?;
            isolation::Settings { plant, ..*bank }.validate(sample_time).map(drop)
        })
    }

    /// Returns the lowest and the highest parameters.
    pub(super) fn bounds(&self) -> (Parameters, Parameters) {
        let Self { time_constant, share, gain, .. } = *self;
        let away = |sign: f64| Parameters {
            time_constant: 1.0 + sign * time_constant,
            share: 1.0 + sign * share,
            gain: 1.0 + sign * gain,
        };
        (away(-1.0), away(1.0))
    }
}

impl Validate for Settings {
    fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        let Self { time_constant, share, gain, rate_per_s, precision, excitation } = *self;
        OutOfRange::check("adaptation.time_constant", time_constant, 0.0..=0.5, "of the model's")?;
        OutOfRange::check("adaptation.share", share, 0.0..=0.5, "of the model's")?;
        OutOfRange::check("adaptation.gain", gain, 0.0..=0.5, "of the model's")?;
        OutOfRange::check("adaptation.rate_per_s", rate_per_s, 0.001..=1.0, "1/s")?;
        OutOfRange::check("adaptation.precision", precision, 1e-4..=0.1, "of the parameter")?;
        OutOfRange::check("adaptation.excitation", excitation, 0.01..=1.0, "of the range")
    }
}

impl Default for Parameters {
    fn default() -> Self {
        Self::STORED
    }
}

impl Parameters {
    /// The parameters of the stored model: each ratio is 1.
    pub const STORED: Self = Self { time_constant: 1.0, share: 1.0, gain: 1.0 };

    /// Returns the spring with these parameters, but for its gain; `stored` is the stored model.
    pub fn applied_to(&self, stored: Plant) -> Plant {
        Plant { share: self.share * stored.share, time_constant_s: self.time_constant * stored.time_constant_s }
    }

    /// Returns the parameters after a fault of this size, one of the three causes.
    fn after(&self, cause: Cause, size: f64, stored: Plant) -> Self {
        match cause {
            Cause::GainError => Self { gain: self.gain * (1.0 + size), ..*self },
            Cause::TimeConstant => Self { time_constant: self.time_constant * libm::exp(size), ..*self },
            _ => Self { share: self.share + size / stored.share, ..*self },
        }
    }

    /// Returns these parameters moved into the range from `low` to `high`.
    fn within(&self, (low, high): (Self, Self)) -> Self {
        self.combined(low, |own, low| own.max(low)).combined(high, |own, high| own.min(high))
    }

    /// Returns `with` of each parameter and the same one of `other`.
    fn combined(&self, other: Self, with: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            time_constant: with(self.time_constant, other.time_constant),
            share: with(self.share, other.share),
            gain: with(self.gain, other.gain),
        }
    }
}

#[cfg(test)]
mod tests;
