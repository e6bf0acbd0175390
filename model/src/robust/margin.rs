//! The settings of the robust pre-compensator, built with the feature `robust`.

use crate::error::OutOfRange;
use crate::units::SampleTime;
use crate::validated::Validate;

/// Part of a step that may be missing when it counts as done: 97 % are reached.
pub(super) const MISSING: f64 = 0.03;
/// How well the spring is known, and what it may overshoot; all without a unit.
///
/// ```
/// use model::{Compensation, Input, Margin, OutOfRange, Settings, State, Volts};
///
/// fn main() -> Result<(), OutOfRange> {
///     // The share of 1/11 may be 10 % larger: a step of 90 V begins with less than the 988 V of the model's share.
///     let margin = Margin { time_constant: 0.05, share: 0.1, ..Margin::TYPICAL };
///     let amplifier = model::Amplifier::up_to(1000.0);
///     let settings = Settings { compensation: Compensation::Robust(margin), amplifier, ..Settings::PAPER };
///     let config = settings.validate()?.quantize();
///     let input = Input { target: Volts::new(90.0)?, ..Input::default() };
///     assert_eq!(config.tick(&mut State::default(), input).applied.to_f64().round(), 898.0);
///     Ok(())
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin {
    /// Largest relative error of all time constants, both ways, 0 to 0.25.
    pub time_constant: f64,
    /// Largest relative error of the instantaneous share, both ways, 0 to 0.25.
    pub share: f64,
    /// Largest relative error of the gain, both ways, 0 to 0.25.
    pub gain: f64,
    /// Overshoot that is allowed on any spring within the errors, as a part of the step, 0 to 0.2.
    pub overshoot: f64,
    /// Part of a step by which all springs may fall back for a while, so that the slow ones are in the band earlier, 0 to 0.5; without a
    /// sensor only. With 0 the spring without errors stays where it is once it is there.
    pub fall_back: f64,
}

impl Margin {
    /// Largest relative error of a parameter, both ways.
    pub const LARGEST_ERROR: f64 = 0.25;

    /// Time constants and share are known to within 5 %; the gain is exact, which no controller without a sensor can correct; 2 % of
    /// overshoot are allowed, and no fall back.
    pub const TYPICAL: Self = Self { time_constant: 0.05, share: 0.05, gain: 0.0, overshoot: 0.02, fall_back: 0.0 };

    /// Returns the settings with these values, in the order of the fields, to be validated. `None` where the crate is built
    /// without the feature `robust`.
    pub const fn from_values(values: [f64; 5]) -> Option<Self> {
        let [time_constant, share, gain, overshoot, fall_back] = values;
        Some(Self { time_constant, share, gain, overshoot, fall_back })
    }

    /// Returns the settings in the order of their fields.
    pub const fn values(&self) -> [f64; 5] {
        let Self { time_constant, share, gain, overshoot, fall_back } = *self;
        [time_constant, share, gain, overshoot, fall_back]
    }

    /// Returns the factors of the quick spring's time constants and share.
    pub(crate) fn factors(&self) -> (f64, f64) {
        (1.0 - self.time_constant, 1.0 + self.share)
    }
}

impl Validate for Margin {
    fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        OutOfRange::check("margin.time_constant", self.time_constant, 0.0..=Self::LARGEST_ERROR, "of the model's")?;
        OutOfRange::check("margin.share", self.share, 0.0..=Self::LARGEST_ERROR, "of the model's")?;
        OutOfRange::check("margin.gain", self.gain, 0.0..=Self::LARGEST_ERROR, "of the model's")?;
        OutOfRange::check("margin.overshoot", self.overshoot, 0.0..=0.2, "of a step")?;
        OutOfRange::check("margin.fall_back", self.fall_back, 0.0..=0.5, "of a step")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_out_of_range_is_rejected_by_name() {
        let time = SampleTime::from_rate(1000.0).unwrap();
        let good = Margin { time_constant: 0.25, share: 0.25, gain: 0.25, overshoot: 0.2, fall_back: 0.5 };
        assert_eq!(good.check(time), Ok(()));
        for (margin, field) in [
            (Margin { time_constant: 0.26, ..good }, "margin.time_constant"),
            (Margin { share: -0.01, ..good }, "margin.share"),
            (Margin { gain: f64::NAN, ..good }, "margin.gain"),
            (Margin { overshoot: 0.21, ..good }, "margin.overshoot"),
            (Margin { fall_back: 0.51, ..good }, "margin.fall_back"),
        ] {
            assert_eq!(margin.check(time).unwrap_err().field, field);
        }
    }

    #[test]
    fn values_are_in_the_order_of_the_fields() {
        let values = [0.1, 0.05, 0.01, 0.02, 0.25];
        let margin = Margin::from_values(values).unwrap();
        assert_eq!(margin.values(), values);
        assert_eq!((margin.time_constant, margin.share, margin.fall_back), (0.1, 0.05, 0.25));
        assert_eq!(margin.factors(), (0.9, 1.05));
    }
}
