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

pub(crate) const TWO_TO_20: f64 = 1_048_576.0;
pub(crate) const TWO_TO_32: f64 = 4_294_967_296.0;
const TWO_TO_52: f64 = 4_503_599_627_370_496.0;

/// `value` in steps of 1 / `a_unit`, to the nearest one; beyond 64 bits, the end. Not inlined, like those below: without a
/// double-precision unit each would be as long again wherever it is used.
#[inline(never)]
pub(crate) fn steps(value: f64, a_unit: f64) -> i64 {
    libm::rint(value * a_unit) as i64
}

/// The nearest signal to `volts`; beyond its range, the end.
#[inline(never)]
pub(crate) fn signal(volts: f64) -> Signal {
    Signal::from_bits(saturated_to_32(steps(volts, TWO_TO_20)))
}

/// The nearest accumulator to `volts`; beyond its range, the end.
pub(crate) fn accumulator(volts: f64) -> Accumulator {
    Accumulator::from_bits(steps(volts, TWO_TO_52))
}

/// What part of its way a first-order lag makes in `seconds`.
#[inline(never)]
pub(crate) fn part_of_way(seconds: f64, time_constant_s: f64) -> f64 {
    -libm::expm1(-seconds / time_constant_s)
}

/// As many of `bits` as fit; beyond, the end.
#[inline(always)]
pub(crate) fn saturated_to_32(bits: i64) -> i32 {
    bits.max(i64::from(i32::MIN)).min(i64::from(i32::MAX)) as i32
}

/// In volts, exactly.
fn volts(signal: Signal) -> f64 {
    f64::from(signal.to_bits()) / TWO_TO_20
}

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
        OutOfRange::check("voltage_v", volts, -2000.0..=2000.0, "V").map(|()| Self(signal(volts)))
    }

    /// In volts, exactly.
    pub fn to_f64(self) -> f64 {
        volts(self.0)
    }
}

impl ScaledStiffness {
    /// In volts of equivalent static voltage, exactly.
    pub fn to_f64(self) -> f64 {
        volts(self.0)
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
        OutOfRange::check("rate_hz", rate_hz, 100.0..=10_000.0, "Hz").map(|()| Self { seconds: 1.0 / rate_hz })
    }

    /// In seconds, 1e-4 to 1e-2.
    pub const fn seconds(self) -> f64 {
        self.seconds
    }

    /// What part of its way a first-order lag makes in one of them.
    pub(crate) fn part_of_way(self, time_constant_s: f64) -> f64 {
        part_of_way(self.seconds, time_constant_s)
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
