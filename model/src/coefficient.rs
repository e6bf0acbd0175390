//! Constant factors of the loop, quantized once and multiplied in one or two instructions.
//!
//! Important terms:
//!
//! - [`Gain`]: turns a signal into a signal. It is an integer plus a signed remainder of 32 fraction bits, so that
//!   neither a gain of 100 nor a share of 0.09 loses precision, and no shift is needed.
//! - [`Rate`]: turns a lag into what an accumulator gains in one tick. A relaxation of 5.5 s covers 1.8e-5 of its
//!   distance in a 10 kHz tick; 32 fraction bits would make its time constant wrong by parts in 1e5, so a rate has 64.
//! - [`Weight`]: a factor in a sum of products. The products are added 64 bits wide and saturated once.
//! - [`WideGain`]: a positive factor of any size, for reciprocals. Its product saturates.

use fixed::types::{I0F32, I5F27, I17F47};

use crate::error::OutOfRange;
use crate::units::{Accumulator, Signal, TWO_TO_32, saturated_to_32, steps};

/// A factor of magnitude up to 1000, rounded to 2^-32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gain {
    integer: i32,
    remainder: I0F32,
}

impl Gain {
    /// Returns the gain nearest to a finite `value` of magnitude at most 1000.
    #[inline(never)]
    pub(crate) fn new(value: f64) -> Self {
        let (integer, remainder) = halves(steps(value, TWO_TO_32));
        Self { integer, remainder: I0F32::from_bits(remainder) }
    }

    /// Returns `signal * self`, rounded down. The product must fit in a signal.
    #[inline(always)]
    pub(crate) fn times(self, signal: Signal) -> Signal {
        Signal::from_bits(signal.to_bits() * self.integer) + upper(signal.wide_mul(self.remainder))
    }
}

/// Fraction of its distance that a lag covers in one tick, 0 up to but not including 1/2, exact to 2^-53 of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rate {
    high: I0F32,
    low: i32,
}

impl Rate {
    /// Returns the rate nearest to a `value` of at least 0 and below 1/2.
    #[inline(never)]
    pub(crate) fn new(value: f64) -> Self {
        let (high, low) = halves((value * TWO_TO_32 * TWO_TO_32) as i64);
        Self { high: I0F32::from_bits(high), low }
    }

    /// Returns what one tick adds for the distance `lag`, too low by less than 2^-51 V.
    #[inline(always)]
    pub(crate) fn step(self, lag: Signal) -> Accumulator {
        let fine = (i64::from(lag.to_bits()) * i64::from(self.low)) >> 32;
        lag.wide_mul(self.high) + Accumulator::from_bits(fine)
    }
}

/// A factor in a sum of products, of magnitude up to 10, rounded to 2^-27.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Weight(I5F27);

/// A sum of signals times weights. It cannot overflow while the magnitudes of the weights add up to at most 10.
pub(crate) type Sum = I17F47;

impl Weight {
    /// The largest magnitude of a weight, and of the magnitudes of all weights in one sum together.
    pub(crate) const MAX: f64 = 10.0;
    /// Number of bits by which a signal is shifted to become a sum.
    pub(crate) const FRACTION_BITS: u32 = I5F27::FRAC_NBITS;

    /// Returns the weight nearest to a finite `value` of magnitude at most 10.
    #[inline(never)]
    pub(crate) fn new(value: f64) -> Self {
        Self(I5F27::from_bits(steps(value, f64::from(1 << Self::FRACTION_BITS)) as i32))
    }

    /// Returns what remains of `budget`, the magnitude that the weights of one sum may still have, after this weight.
    ///
    /// # Errors
    /// [`OutOfRange`] if the magnitude of `value` exceeds `budget`.
    pub(crate) fn spend(field: &'static str, value: f64, budget: f64) -> Result<f64, OutOfRange> {
        OutOfRange::check(field, value, -budget..=budget, "left of a sum of 10").map(|()| budget - value.abs())
    }

    /// Returns the factor itself, exactly.
    pub(crate) fn to_f64(self) -> f64 {
        f64::from(self.0.to_bits()) / f64::from(1 << Self::FRACTION_BITS)
    }

    /// Returns `signal / self`, saturated to a signal's range. Off the hot path: it divides.
    #[cfg(feature = "time-optimal")]
    pub(crate) fn divide(self, signal: Signal) -> Signal {
        let whole = i64::from(signal.to_bits()) << Self::FRACTION_BITS;
        let bits = whole.checked_div(i64::from(self.0.to_bits())).unwrap_or(whole);
        Signal::from_bits(saturated_to_32(bits))
    }

    /// Returns `signal * self`, exactly.
    #[inline(always)]
    pub(crate) fn times(self, signal: Signal) -> Sum {
        signal.wide_mul(self.0)
    }
}

const TWO_TO_29: f64 = 536_870_912.0;

/// A positive factor from 2^-32 to 2^29, exact to 2^-30 of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WideGain {
    mantissa: i32,
    shift: u8,
}

impl WideGain {
    /// Returns the factor nearest to a positive, finite `value`, saturated to its range.
    #[inline(never)]
    pub(crate) fn new(value: f64) -> Self {
        // The bits of a positive number are its exponent above its mantissa, so they sort like the number.
        let bits = value.to_bits().max((1.0 / TWO_TO_32).to_bits()).min(TWO_TO_29.to_bits());
        let mantissa = bits & ((1 << 52) - 1) | 1 << 52;
        Self { mantissa: ((mantissa + (1 << 22)) >> 23) as i32, shift: (1052 - (bits >> 52)) as u8 }
    }

    /// Returns `signal * self`, rounded down and saturated to a signal's range.
    #[inline(always)]
    pub(crate) fn times(self, signal: Signal) -> Signal {
        let product = (i64::from(signal.to_bits()) * i64::from(self.mantissa)) >> (self.shift & 63);
        Signal::from_bits(saturated_to_32(product))
    }
}

/// Converts a sum to a signal, rounded down and saturated to a signal's range.
#[inline(always)]
pub(crate) fn saturated(sum: Sum) -> Signal {
    Signal::from_bits(saturated_to_32(sum.to_bits() >> Weight::FRACTION_BITS))
}

/// Converts a signal to a sum, exactly.
#[inline(always)]
pub(crate) fn sum(signal: Signal) -> Sum {
    Sum::from_bits(i64::from(signal.to_bits()) << Weight::FRACTION_BITS)
}

/// Splits 64 bits into upper and lower 32 bits, the upper ones rounded to the nearest, so that the lower ones are
/// signed.
const fn halves(bits: i64) -> (i32, i32) {
    let high = (bits + (1 << 31)) >> 32;
    (high as i32, bits as i32)
}

/// Returns the upper half of an accumulator, which is the same value rounded down to a signal.
#[inline(always)]
pub(crate) const fn upper(accumulator: Accumulator) -> Signal {
    Signal::from_bits((accumulator.to_bits() >> 32) as i32)
}

/// Converts a signal to an accumulator, exactly.
#[inline(always)]
pub(crate) const fn widened(signal: Signal) -> Accumulator {
    Accumulator::from_bits((signal.to_bits() as i64) << 32)
}

#[cfg(test)]
mod tests;
