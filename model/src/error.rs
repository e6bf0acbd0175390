//! The one error of this crate: a value that a person set is outside what is allowed.

use core::fmt;
use core::ops::RangeInclusive;

/// A named value outside its allowed range; NaN is outside of every range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutOfRange {
    /// Name of the setting, as in [`crate::Settings`].
    pub field: &'static str,
    /// The refused value, in `unit`.
    pub value: f64,
    /// Lowest allowed value, in `unit`.
    pub lowest: f64,
    /// Highest allowed value, in `unit`.
    pub highest: f64,
    /// Unit of the three numbers.
    pub unit: &'static str,
}

impl OutOfRange {
    /// An error unless `value` lies in `allowed`.
    #[inline(always)]
    pub(crate) fn check(
        field: &'static str,
        value: f64,
        allowed: RangeInclusive<f64>,
        unit: &'static str,
    ) -> Result<(), Self> {
        let (lowest, highest) = allowed.into_inner();
        Self { field, value, lowest, highest, unit }.judged()
    }

    /// Not inlined: soft floats are long.
    #[inline(never)]
    fn judged(self) -> Result<(), Self> {
        let inside = self.lowest <= self.value && self.value <= self.highest;
        if inside { Ok(()) } else { Err(self) }
    }

    /// The same for how many there are of something.
    pub(crate) fn check_count(
        field: &'static str,
        count: usize,
        allowed: RangeInclusive<usize>,
        unit: &'static str,
    ) -> Result<(), Self> {
        Self::check(field, count as f64, *allowed.start() as f64..=*allowed.end() as f64, unit)
    }
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { field, value, lowest, highest, unit } = self;
        write!(f, "{field} = ")?;
        // Not with hundreds of digits.
        let many = value.is_finite() && *value != 0.0 && !(1e-9..1e15).contains(&value.abs());
        if many { write!(f, "{value:e}") } else { write!(f, "{value}") }?;
        write!(f, " is not allowed: expected {lowest}")?;
        if lowest != highest {
            write!(f, " to {highest}")?;
        }
        write!(f, " {unit}")
    }
}

impl core::error::Error for OutOfRange {}
