//! Constant factors of the loop, scaled once and multiplied in one or two instructions.
//!
//! - [`Gain`] turns a signal into a signal: a whole number and a signed rest of 32 fraction bits, so that neither a gain
//!   of 100 nor a share of 0.09 loses precision, and no shift is needed.
//! - [`Rate`] turns a lag into what an accumulator gains in one tick. A relaxation of 5.5 s moves by 1.8e-5 of its lag
//!   in a 10 kHz tick; 32 fraction bits would put its time constant off by parts in 1e5, so it has 64.
//! - [`Weight`] is a factor of a sum of products: the products are added 64 bits wide and saturated once.
//! - [`Steep`] is a positive factor of any size, for reciprocals; what it makes saturates.

use fixed::types::{I0F32, I5F27, I17F47};

use crate::error::OutOfRange;
use crate::units::{Accumulator, Signal, TWO_TO_32, saturated_to_32, steps};

/// A factor of magnitude up to 1000, exact to 2^-33.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gain {
    whole: i32,
    rest: I0F32,
}

impl Gain {
    /// The nearest gain to a finite `value` of at most 1000.
    #[inline(never)]
    pub(crate) fn new(value: f64) -> Self {
        let (whole, rest) = halves(steps(value, TWO_TO_32));
        Self { whole, rest: I0F32::from_bits(rest) }
    }

    /// `signal * self`, rounded down; the caller knows that it fits.
    #[inline(always)]
    pub(crate) fn times(self, signal: Signal) -> Signal {
        Signal::from_bits(signal.to_bits() * self.whole) + upper(signal.wide_mul(self.rest))
    }
}

/// What part of a lag is made up in one tick, 0 up to but not including 1/2, exact to 2^-53 of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rate {
    high: I0F32,
    low: i32,
}

impl Rate {
    /// The nearest rate to a `value` of at least 0 and below 1/2.
    #[inline(never)]
    pub(crate) fn new(value: f64) -> Self {
        let (high, low) = halves((value * TWO_TO_32 * TWO_TO_32) as i64);
        Self { high: I0F32::from_bits(high), low }
    }

    /// What one tick adds for `lag`, low by less than 2^-51 V.
    #[inline(always)]
    pub(crate) fn step(self, lag: Signal) -> Accumulator {
        let fine = (i64::from(lag.to_bits()) * i64::from(self.low)) >> 32;
        lag.wide_mul(self.high) + Accumulator::from_bits(fine)
    }
}

/// A factor of a sum of products, magnitude up to 10, exact to 2^-28.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Weight(I5F27);

/// Signals times weights: with weights whose magnitudes add up to at most 10 it cannot overflow.
pub(crate) type Sum = I17F47;

impl Weight {
    /// The largest magnitude, and the largest sum of magnitudes.
    pub(crate) const MOST: f64 = 10.0;
    /// What a signal is shifted by to become a sum.
    pub(crate) const FRACTION_BITS: u32 = I5F27::FRAC_NBITS;

    /// The nearest weight to a finite `value` of at most 10.
    #[inline(never)]
    pub(crate) fn new(value: f64) -> Self {
        Self(I5F27::from_bits(steps(value, f64::from(1 << Self::FRACTION_BITS)) as i32))
    }

    /// What is left of the magnitude that the weights of one sum may have together, after this one.
    pub(crate) fn budget(field: &'static str, value: f64, left: f64) -> Result<f64, OutOfRange> {
        OutOfRange::check(field, value, -left..=left, "left of a sum of 10").map(|()| left - value.abs())
    }

    /// The factor itself, exactly.
    pub(crate) fn to_f64(self) -> f64 {
        f64::from(self.0.to_bits()) / f64::from(1 << Self::FRACTION_BITS)
    }

    /// What this weight makes `signal` of; beyond a signal's range, its end. Off the hot path: it divides.
    #[cfg(feature = "time-optimal")]
    pub(crate) fn into(self, signal: Signal) -> Signal {
        let whole = i64::from(signal.to_bits()) << Self::FRACTION_BITS;
        let bits = whole.checked_div(i64::from(self.0.to_bits())).unwrap_or(whole);
        Signal::from_bits(saturated_to_32(bits))
    }

    /// `signal * self`, exactly.
    #[inline(always)]
    pub(crate) fn of(self, signal: Signal) -> Sum {
        signal.wide_mul(self.0)
    }
}

const TWO_TO_29: f64 = 536_870_912.0;

/// A positive factor from 2^-32 to 2^29, exact to 2^-30 of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steep {
    mantissa: i32,
    shift: u8,
}

impl Steep {
    /// The nearest to a positive, finite `value`; beyond its range, the end.
    #[inline(never)]
    pub(crate) fn new(value: f64) -> Self {
        // The bits of a positive number are its exponent over its mantissa, so they sort like the number.
        let bits = value.to_bits().max((1.0 / TWO_TO_32).to_bits()).min(TWO_TO_29.to_bits());
        let mantissa = bits & ((1 << 52) - 1) | 1 << 52;
        Self { mantissa: ((mantissa + (1 << 22)) >> 23) as i32, shift: (1052 - (bits >> 52)) as u8 }
    }

    /// `signal * self`, rounded down; beyond a signal's range, its end.
    #[inline(always)]
    pub(crate) fn times(self, signal: Signal) -> Signal {
        let product = (i64::from(signal.to_bits()) * i64::from(self.mantissa)) >> (self.shift & 63);
        Signal::from_bits(saturated_to_32(product))
    }
}

/// The signal of a sum, rounded down; beyond a signal's range, its end.
#[inline(always)]
pub(crate) fn saturated(sum: Sum) -> Signal {
    Signal::from_bits(saturated_to_32(sum.to_bits() >> Weight::FRACTION_BITS))
}

/// Upper and lower 32 bits, the upper ones rounded to the nearest, so that the lower ones are a signed number too.
const fn halves(bits: i64) -> (i32, i32) {
    let high = (bits + (1 << 31)) >> 32;
    (high as i32, (bits - (high << 32)) as i32)
}

/// The upper half of an accumulator, which is a signal, rounded down.
#[inline(always)]
pub(crate) const fn upper(accumulator: Accumulator) -> Signal {
    Signal::from_bits((accumulator.to_bits() >> 32) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_gain_rounds_down_by_less_than_two_units(gain in -100.0..100.0f64, volts in -20.0..20.0f64) {
            let signal = Signal::from_num(volts);
            let got = f64::from(Gain::new(gain).times(signal).to_bits());
            let exact = gain * f64::from(signal.to_bits());
            prop_assert!(got <= exact + 0.01 && got > exact - 1.01, "{got} {exact}");
        }

        #[test]
        fn a_steep_factor_is_exact_or_saturates(exponent in -31.0..28.0f64, volts in -2000.0..2000.0f64) {
            let (factor, signal) = (libm::exp2(exponent), Signal::from_num(volts));
            let got = Steep::new(factor).times(signal).to_num::<f64>();
            let exact = (factor * signal.to_num::<f64>()).clamp(-2048.0, Signal::MAX.to_num());
            prop_assert!((got - exact).abs() < exact.abs() * 2e-9 + 1e-6, "{got} {exact}");
        }

        #[test]
        fn a_rate_keeps_its_precision_over_eight_decades(exponent in -8.0..-0.302f64, volts in -1000.0..1000.0f64) {
            let (rate, lag) = (libm::pow(10.0, exponent), Signal::from_num(volts));
            let got = Rate::new(rate).step(lag).to_bits() as f64;
            let exact = rate * f64::from(lag.to_bits()) * TWO_TO_32;
            prop_assert!((got - exact).abs() <= exact.abs() * 1e-15 + 2.0, "{got} {exact}");
        }
    }

    #[test]
    fn halves_are_gains_too() {
        for value in [0.0, 0.5, -0.5, 1.5, 0.499_999_999_99, 99.5, 1.0 - 1e-12] {
            let got = Gain::new(value).times(Signal::from_num(16)).to_num::<f64>();
            assert!((got - 16.0 * value).abs() < 2e-6, "{value} {got}");
        }
    }
}
