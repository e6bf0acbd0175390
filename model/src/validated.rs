//! Settings become fixed-point numbers in two steps: they are validated, and only what is validated can be quantized.
//!
//! Important terms:
//!
//! - *settings*: what a person writes or a file holds, in SI units and floats ([`crate::Settings`], [`crate::Plant`],
//!   [`crate::supervisor::Settings`]).
//! - *validate*: check every field of the settings for one sample time. The result is an error that names the field, or
//!   a [`Validated`] token.
//! - *quantize*: round the settings to fixed-point numbers for that sample time. It cannot fail, and it is a method of
//!   the token only: outside its allowed range a setting would overflow its number format.
//!
//! ```
//! use model::{OutOfRange, Settings};
//!
//! fn main() -> Result<(), OutOfRange> {
//!     let config = Settings::PAPER.validate()?.quantize();
//!     assert_eq!(config.range().1.to_f64().round(), 700.0);
//!     Ok(())
//! }
//! ```
//!
//! Settings that were not validated cannot be quantized:
//!
//! ```compile_fail,E0599
//! use model::Settings;
//!
//! let config = Settings::PAPER.quantize();
//! ```
//!
//! and only `validate` makes the token:
//!
//! ```compile_fail,E0451
//! use model::{SampleTime, Settings, Validated};
//!
//! let sample_time = SampleTime::from_rate(1000.0).unwrap();
//! let forged = Validated { settings: &Settings::PAPER, sample_time };
//! ```

use crate::error::OutOfRange;
use crate::units::SampleTime;

/// Settings whose fields can be checked for one sample time.
pub trait Validate: Sized {
    /// Checks every field, and makes nothing.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first field outside its allowed range, its value and the range.
    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange>;

    /// Checks every field and returns the token with which the settings can be quantized for `sample_time`.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first field outside its allowed range, its value and the range.
    fn validate(&self, sample_time: SampleTime) -> Result<Validated<'_, Self>, OutOfRange> {
        self.check(sample_time).map(|()| Validated::new(self, sample_time))
    }
}

/// Absent settings are valid.
impl<T: Validate> Validate for Option<T> {
    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        self.as_ref().map_or(Ok(()), |settings| settings.check(sample_time))
    }
}

/// Proof that `T` was checked for one sample time. Nothing can be quantized without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Validated<'a, T> {
    settings: &'a T,
    sample_time: SampleTime,
}

impl<'a, T> Validated<'a, T> {
    /// Makes the token; to be called only after every field of `settings` was checked for `sample_time`.
    pub(crate) const fn new(settings: &'a T, sample_time: SampleTime) -> Self {
        Self { settings, sample_time }
    }

    /// Returns the token of one part of these settings, which was checked with the whole.
    pub(crate) const fn part<U>(self, part: &'a U) -> Validated<'a, U> {
        Validated::new(part, self.sample_time)
    }

    /// Returns the settings that were checked.
    pub const fn settings(self) -> &'a T {
        self.settings
    }

    /// Returns the time between two ticks for which the settings were checked.
    pub const fn sample_time(self) -> SampleTime {
        self.sample_time
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::Plant;

    #[test]
    fn a_part_that_may_be_absent_is_checked_if_it_is_there() {
        let time = SampleTime::from_rate(1000.0).unwrap();
        let slow = Plant { time_constant_s: 1e5, ..Plant::PAPER };
        assert_eq!(Some(slow).check(time).unwrap_err().field, "time_constant_s");
        assert_eq!((Some(Plant::PAPER).check(time), None::<Plant>.check(time)), (Ok(()), Ok(())));
    }
}
