//! A lag whose time constant depends on the voltage.
//!
//! Important terms:
//!
//! - *rate*, `r`: the fraction of its distance that the lag covers in a tick, `1 - exp(-T / tau)`.
//! - *inverse rate*, `1 / r`: almost linear in the time constant.
//!
//! ```text
//! tau(v) = low + (high - low) v / 500 V     for 0 <= v <= 1000 V, but at least half of the shorter one
//! r = 1 - exp(-x),   1 / r = 1 / x + 1 / 2 + x / 12 - ...,   x = T / tau
//! ```
//!
//! So the tick interpolates `1 / r` linearly between 0 V and the voltage where `tau` ends, exact at both, and inverts
//! it: one 32-bit division and one Newton step, exact to 2^-20. The neglected part is less than `x^2 / 12` of `r` for
//! the shortest `tau`: 1e-5 from a hundred sample times on, 5e-3 at four. A rate that is wrong by a fraction `e` makes
//! the step response wrong by less than `e / 2.7` of the step.

use crate::units::{Accumulator, SampleTime, Signal, signal, steps};

/// Additional fraction bits of the inverse rate's slope; the inverse rate changes by less than 2^31 up to 500 V.
const SLOPE_BITS: u32 = 8;

/// A time constant that is linear in the voltage, in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeConstant {
    /// Time constant at 0 V, in s.
    pub low_s: f64,
    /// Time constant at 500 V, in s.
    pub high_s: f64,
}

impl TimeConstant {
    /// Returns the time constant, in s, at `volts`: constant below 0 V, linear above it, and at least half of the
    /// shorter of the two given ones.
    pub fn at(&self, volts: f64) -> f64 {
        self.linear(volts.max(0.0)).max(self.floor_s())
    }

    fn linear(&self, volts: f64) -> f64 {
        self.low_s + (self.high_s - self.low_s) * volts / 500.0
    }

    fn floor_s(&self) -> f64 {
        0.5 * self.low_s.min(self.high_s)
    }

    /// Returns the voltage up to which the time constant is linear, 500 to 1000 V.
    pub(super) fn end_v(&self) -> f64 {
        if self.linear(1000.0) >= self.floor_s() {
            return 1000.0;
        }
        500.0 * (self.low_s - self.floor_s()) / (self.low_s - self.high_s)
    }
}

/// The inverse rate, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct VaryingRate {
    /// `1 / r` at 0 V, in 2^(shift - 24), below 2^31.
    at_zero: i32,
    per_volt: i32,
    end: Signal,
    /// 0 to 31
    shift: u8,
}

impl VaryingRate {
    /// Quantizes the inverse rate of a time constant that is at least two sample times at all voltages, and nowhere
    /// shorter than a twentieth of its longest value.
    pub(crate) fn new(tau: &TimeConstant, sample_time: SampleTime) -> Self {
        let inverse = |volts| 1.0 / sample_time.lag_fraction(tau.at(volts));
        let (end_v, at_zero) = (tau.end_v(), inverse(0.0));
        let longest = at_zero.max(inverse(end_v));
        let (mut shift, mut scale) = (0, f64::from(1 << 24));
        while longest * scale >= f64::from(1u32 << 31) {
            (shift, scale) = (shift + 1, 0.5 * scale);
        }
        let per_volt = (inverse(end_v) - at_zero) / end_v;
        Self {
            at_zero: steps(at_zero, scale) as i32,
            per_volt: steps(per_volt, f64::from(1 << SLOPE_BITS) * scale) as i32,
            end: signal(end_v),
            shift,
        }
    }

    /// Returns what one tick at `voltage` adds for the distance `lag`.
    #[inline(always)]
    pub(crate) fn step(&self, voltage: Signal, lag: Signal) -> Accumulator {
        let voltage = voltage.max(Signal::ZERO).min(self.end);
        let more = (i64::from(voltage.to_bits()) * i64::from(self.per_volt)) >> (Signal::FRAC_NBITS + SLOPE_BITS);
        // 25.3 to 31 bits, so that the first guess of its reciprocal is exact to 2^-10 and the rate has at most 31
        // bits.
        let inverse = self.at_zero + more as i32;
        let guess = (1u32 << 31).checked_div(inverse as u32 >> 15).unwrap_or(0);
        let missing = (1 << 46) - i64::from(inverse) * i64::from(guess);
        let rate = (i64::from(guess) << 10) + ((i64::from(guess) * (missing >> 20)) >> 16);
        // 2^56 / inverse, times the lag in 2^-20: scaled back to 2^-52.
        Accumulator::from_bits((i64::from(lag.to_bits()) * i64::from(rate as i32)) >> self.shift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 4 } else { 2000 }))]

        /// The bound of the module documentation, over the whole range of accepted settings.
        #[test]
        fn the_error_of_the_rate_is_below_the_documented_bound(
            rate in 2.0..=4.0f64,
            ticks in 0.61..6.0f64,
            ratio in -1.0..=1.0f64,
            volts in -100.0..=1000.0f64,
            lag in -2000.0..2000.0f64,
        ) {
            let rate_hz = libm::pow(10.0, rate);
            let low_s = libm::pow(10.0, ticks) / rate_hz;
            let tau = TimeConstant { low_s, high_s: (low_s * libm::pow(10.0, ratio)).max(4.0 / rate_hz) };
            let sample_time = SampleTime::from_rate(rate_hz).unwrap();
            let lag = Signal::from_num(lag);
            let got = VaryingRate::new(&tau, sample_time).step(Signal::from_num(volts), lag).to_num::<f64>();
            let x = sample_time.seconds() / tau.at(volts);
            let exact = -libm::expm1(-x) * lag.to_num::<f64>();
            let shortest = sample_time.seconds() / tau.at(0.0).min(tau.at(1000.0));
            let allowed = exact.abs() * (shortest * shortest / 12.0 + 1.5e-6) + 1e-12;
            prop_assert!((got - exact).abs() < allowed, "{tau:?}: {got} {exact}");
        }
    }

    #[test]
    fn the_time_constant_is_linear_beyond_500_v_and_at_least_half_of_the_shorter_one() {
        let rising = TimeConstant { low_s: 5.5, high_s: 8.0 };
        assert_eq!([-10.0, 0.0, 500.0, 700.0].map(|volts| rising.at(volts)), [5.5, 5.5, 8.0, 9.0]);
        let falling = TimeConstant { low_s: 8.0, high_s: 4.0 };
        assert_eq!([0.0, 500.0, 625.0, 1000.0].map(|volts| falling.at(volts)), [8.0, 4.0, 3.0, 2.0]);
    }
}
