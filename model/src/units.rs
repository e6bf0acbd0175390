//! Number formats, and one type for each quantity that must not be mixed with another.
//!
//! Important terms:
//!
//! - *signal*: a value at one tick, 32 bits wide. [`Signal`] has 12 integer and 20 fraction bits: +-2048 V in steps of
//!   0.95 uV, for voltages of up to 1000 V and their differences.
//! - *accumulator*: a value summed over many ticks, 64 bits wide. [`Accumulator`] has 12 integer and 52 fraction bits,
//!   so its upper half is a signal: reading it costs nothing and cannot wrap.
//! - *scaled stiffness*: stiffness expressed as the equivalent static voltage, in V ([`ScaledStiffness`]).
//! - *sample time*: the time between two ticks, in s ([`SampleTime`]).

use fixed::types::{I12F20, I12F52};

use crate::error::OutOfRange;

/// A value at one tick: 12 integer and 20 fraction bits.
pub type Signal = I12F20;
/// A value summed over many ticks: 12 integer and 52 fraction bits.
pub type Accumulator = I12F52;

pub(crate) const TWO_TO_20: f64 = 1_048_576.0;
pub(crate) const TWO_TO_32: f64 = 4_294_967_296.0;
const TWO_TO_52: f64 = 4_503_599_627_370_496.0;

/// Returns `value * steps_per_unit`, rounded to the nearest integer and saturated to 64 bits. Not inlined, like the
/// functions below: without a double-precision unit each copy would be long.
#[inline(never)]
pub(crate) fn steps(value: f64, steps_per_unit: f64) -> i64 {
    libm::rint(value * steps_per_unit) as i64
}

/// Returns the signal nearest to `volts`, saturated to its range.
#[inline(never)]
pub(crate) fn signal(volts: f64) -> Signal {
    Signal::from_bits(saturated_to_32(steps(volts, TWO_TO_20)))
}

/// Returns the accumulator nearest to `volts`, saturated to its range.
pub(crate) fn accumulator(volts: f64) -> Accumulator {
    Accumulator::from_bits(steps(volts, TWO_TO_52))
}

/// Returns the fraction of its distance to a constant input that a first-order lag covers in `seconds`:
/// `1 - exp(-seconds / time_constant_s)`.
#[inline(never)]
pub(crate) fn lag_fraction(seconds: f64, time_constant_s: f64) -> f64 {
    -libm::expm1(-seconds / time_constant_s)
}

/// Saturates a 64-bit integer to 32 bits.
#[inline(always)]
pub(crate) fn saturated_to_32(bits: i64) -> i32 {
    // One comparison of the upper half instead of two of 64 bits.
    let low = bits as i32;
    if i64::from(low) == bits { low } else { (bits >> 63) as i32 ^ i32::MAX }
}

/// Returns `value`, and marks the branch that calls it as rare.
///
/// A limit rarely acts. Marked so, its branch stays one: the MCU's compiler makes a single comparison, under whose condition it moves
/// the value and reports the limit, and a host, which predicts branches, does not wait for limits that do not act.
#[cold]
#[inline]
pub(crate) fn rarely(value: Signal) -> Signal {
    value
}

/// Converts a signal to volts, exactly.
fn volts(signal: Signal) -> f64 {
    f64::from(signal.to_bits()) / TWO_TO_20
}

/// Voltage across the spring, in V, +-2048 V in steps of 0.95 uV.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Volts(pub Signal);

/// Stiffness expressed as the equivalent static voltage: the voltage, in V, that would give this stiffness once the
/// spring has settled.
///
/// [`Spring`](crate::Spring) converts it to Pa and N/m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ScaledStiffness(pub Signal);

impl Volts {
    /// Zero volts.
    pub const ZERO: Self = Self(Signal::ZERO);

    /// Rounds `volts` to the nearest representable voltage.
    ///
    /// # Errors
    /// [`OutOfRange`] if `volts` is NaN or beyond +-2000 V.
    pub fn new(volts: f64) -> Result<Self, OutOfRange> {
        OutOfRange::check("voltage_v", volts, -2000.0..=2000.0, "V").map(|()| Self(signal(volts)))
    }

    /// Returns the voltage in V, exactly.
    pub fn to_f64(self) -> f64 {
        volts(self.0)
    }
}

impl ScaledStiffness {
    /// Returns the equivalent static voltage in V, exactly.
    pub fn to_f64(self) -> f64 {
        volts(self.0)
    }
}

/// Code to be written to the DAC, 0 to 2^bits - 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct DacCode(pub u16);

/// Time between two ticks, 0.1 to 10 ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleTime {
    seconds: f64,
}

impl SampleTime {
    /// Returns the sample time of a rate of 100 to 10 000 ticks per second.
    ///
    /// # Errors
    /// [`OutOfRange`] if `rate_hz` is NaN or not 100 to 10 000 Hz.
    pub fn from_rate(rate_hz: f64) -> Result<Self, OutOfRange> {
        OutOfRange::check("rate_hz", rate_hz, 100.0..=10_000.0, "Hz").map(|()| Self { seconds: 1.0 / rate_hz })
    }

    /// Returns the sample time in s, 1e-4 to 1e-2.
    pub const fn seconds(self) -> f64 {
        self.seconds
    }

    /// Returns the fraction of its distance to a constant input that a first-order lag covers in one tick, 0 to 1.
    pub(crate) fn lag_fraction(self, time_constant_s: f64) -> f64 {
        lag_fraction(self.seconds, time_constant_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volts_reject_nan_infinity_and_values_beyond_2000_v() {
        assert!(Volts::new(f64::NAN).is_err());
        assert!(Volts::new(f64::INFINITY).is_err());
        assert!(Volts::new(2001.0).is_err());
        assert_eq!(Volts::new(512.25).unwrap().to_f64(), 512.25);
    }

    #[test]
    fn rates_outside_100_hz_to_10_khz_are_rejected_by_name() {
        for rate in [0.0, -1.0, 99.9, 10_001.0, f64::NAN] {
            assert_eq!(SampleTime::from_rate(rate).unwrap_err().field, "rate_hz");
        }
        assert_eq!(SampleTime::from_rate(1000.0).unwrap().seconds(), 1e-3);
    }
}
