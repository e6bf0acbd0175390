//! The error of this crate: a setting outside its allowed range.

use core::fmt;
use core::ops::RangeInclusive;

/// A named value outside its allowed range. NaN is outside every range.
///
/// It prints as one line that names the field, the value, the range and the unit:
///
/// ```
/// use model::{Amplifier, Settings};
///
/// let amplifier = Amplifier { full_scale_v: 1500.0, ..Amplifier::PAPER };
/// let error = Settings { amplifier, ..Settings::PAPER }.validate().unwrap_err();
/// assert_eq!(error.to_string(), "full_scale_v = 1500 is not allowed: expected 50 to 1000 V");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutOfRange {
    /// Name of the setting, spelled as the field of the settings or as the key in a plant file.
    pub field: &'static str,
    /// The rejected value, in `unit`.
    pub value: f64,
    /// Lowest allowed value, in `unit`.
    pub lowest: f64,
    /// Highest allowed value, in `unit`.
    pub highest: f64,
    /// Unit of `value`, `lowest` and `highest`.
    pub unit: &'static str,
}

impl OutOfRange {
    /// Returns an error unless `value` lies inside `allowed`, ends included.
    #[inline(always)]
    pub(crate) fn check(
        field: &'static str,
        value: f64,
        allowed: RangeInclusive<f64>,
        unit: &'static str,
    ) -> Result<(), Self> {
        let (lowest, highest) = allowed.into_inner();
        Self { field, value, lowest, highest, unit }.unless_inside()
    }

    /// Returns `self` as an error unless its value lies inside its range. Not inlined: each comparison of soft floats
    /// is a call.
    #[inline(never)]
    fn unless_inside(self) -> Result<(), Self> {
        let inside = self.lowest <= self.value && self.value <= self.highest;
        if inside { Ok(()) } else { Err(self) }
    }

    /// Returns an error unless `count` lies inside `allowed`, ends included.
    pub(crate) fn check_count(
        field: &'static str,
        count: usize,
        allowed: RangeInclusive<usize>,
        unit: &'static str,
    ) -> Result<(), Self> {
        Self::check(field, count as f64, *allowed.start() as f64..=*allowed.end() as f64, unit)
    }
}

/// A number that prints in exponential form where plain decimals would have hundreds of digits.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value) = *self;
        let exponential = value.is_finite() && value != 0.0 && !(1e-9..1e15).contains(&value.abs());
        if exponential { write!(f, "{value:e}") } else { write!(f, "{value}") }
    }
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { field, value, lowest, highest, unit } = self;
        write!(f, "{field} = {} is not allowed: expected {}", Short(*value), Short(*lowest))?;
        if lowest != highest {
            write!(f, " to {}", Short(*highest))?;
        }
        write!(f, " {unit}")?;
        // The bound is another setting, which a user who raises this one must raise too.
        if *field == "max_v" { write!(f, "; `full_scale_v` bounds it, `Amplifier::up_to` sets both") } else { Ok(()) }
    }
}

impl core::error::Error for OutOfRange {}
