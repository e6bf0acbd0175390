//! Number formats and the types of what must not be mixed.
//!
//! A signal is 32 bits wide, [`Signal`] = 12 integer and 20 fraction bits: +-2048 V in steps of 0.95 uV, for voltages of
//! up to 1000 V and their differences. What is summed over many ticks is 64 bits wide, [`Accumulator`] = 12 integer and
//! 52 fraction bits, so that its upper half *is* a signal: reading it costs nothing and cannot wrap.

use fixed::types::{I12F20, I12F52};

use crate::error::OutOfRange;

/// A value at one tick.
pub type Signal = I12F20;
/// A value summed over many ticks.
pub type Accumulator = I12F52;

/// Voltage across the spring, in volts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Volts(pub Signal);

/// Stiffness on the scale of the stair experiment: the static voltage, in volts, that would give it in the end.
///
/// [`crate::stiffness`] turns it into Pa and N/m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ScaledStiffness(pub Signal);

impl Volts {
    /// No voltage.
    pub const ZERO: Self = Self(Signal::ZERO);

    /// The nearest representable voltage; `volts` must lie within +-2000 V.
    ///
    /// # Errors
    /// [`OutOfRange`] for NaN and anything beyond.
    pub fn new(volts: f64) -> Result<Self, OutOfRange> {
        OutOfRange::check("voltage_v", volts, -2000.0..=2000.0, "V").map(|v| Self(Signal::from_num(v)))
    }

    /// In volts, exactly.
    pub fn to_f64(self) -> f64 {
        self.0.to_num()
    }
}

impl ScaledStiffness {
    /// In volts of equivalent static voltage, exactly.
    pub fn to_f64(self) -> f64 {
        self.0.to_num()
    }
}

/// What is written to the DAC: 0 to 2^bits - 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct DacCode(pub u16);

/// Time between two ticks, from a rate of 100 Hz to 10 kHz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleTime {
    seconds: f64,
}

impl SampleTime {
    /// # Errors
    /// [`OutOfRange`] unless `rate_hz` lies in 100 to 10 000 Hz.
    pub fn from_rate(rate_hz: f64) -> Result<Self, OutOfRange> {
        let rate_hz = OutOfRange::check("rate_hz", rate_hz, 100.0..=10_000.0, "Hz")?;
        Ok(Self { seconds: 1.0 / rate_hz })
    }

    /// In seconds, 1e-4 to 1e-2.
    pub const fn seconds(self) -> f64 {
        self.seconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volts_reject_what_they_cannot_hold() {
        assert!(Volts::new(f64::NAN).is_err());
        assert!(Volts::new(f64::INFINITY).is_err());
        assert!(Volts::new(2001.0).is_err());
        assert_eq!(Volts::new(512.25).unwrap().to_f64(), 512.25);
    }

    #[test]
    fn rates_outside_100_hz_to_10_khz_are_named() {
        for rate in [0.0, -1.0, 99.9, 10_001.0, f64::NAN] {
            assert_eq!(SampleTime::from_rate(rate).unwrap_err().field, "rate_hz");
        }
        assert_eq!(SampleTime::from_rate(1000.0).unwrap().seconds(), 1e-3);
    }
}
