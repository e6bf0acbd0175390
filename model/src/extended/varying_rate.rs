//! A relaxation whose time constant depends on the voltage.
//!
//! ```text
//! tau(v) = low + (high - low) v / 500 V     for v >= 0; beyond 500 V it goes on, but not below half of the shorter one
//! ```
//!
//! What part `r` of its distance a lag makes in a tick is curved in `tau`, but `1 / r` is almost straight:
//!
//! ```text
//! r = 1 - exp(-x),   1 / r = 1 / x + 1 / 2 + x / 12 - ...,   x = T / tau
//! ```
//!
//! So the tick takes `1 / r` for straight between 0 V and where `tau` ends, exact at both ends, and inverts it: one
//! 32-bit division and one Newton step, exact to 2^-20. What is neglected is less than `x^2 / 12` of `r` with the shortest
//! `tau`: 1e-5 from a hundred sample times on, 5e-3 at four. A rate that is off by a part `e` puts the response to a step
//! off by less than `e / 2.7` of the step.

use crate::units::{Accumulator, SampleTime, Signal};

/// Fraction bits of the inverse rate's slope beyond its own; up to 500 V it changes by less than 2^31.
const MORE_BITS: u32 = 8;

/// A time constant that goes straight with the voltage, in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeConstant {
    /// At 0 V.
    pub low_s: f64,
    /// At 500 V.
    pub high_s: f64,
}

impl TimeConstant {
    /// In s, at `volts`.
    pub fn at(&self, volts: f64) -> f64 {
        self.straight(volts.max(0.0)).max(self.floor_s())
    }

    fn straight(&self, volts: f64) -> f64 {
        self.low_s + (self.high_s - self.low_s) * volts / 500.0
    }

    fn floor_s(&self) -> f64 {
        0.5 * self.low_s.min(self.high_s)
    }

    /// The voltage up to which it is straight, 500 to 1000 V.
    fn end_v(&self) -> f64 {
        if self.straight(1000.0) >= self.floor_s() {
            return 1000.0;
        }
        500.0 * (self.low_s - self.floor_s()) / (self.low_s - self.high_s)
    }

    /// The shortest at any voltage of an amplifier.
    pub(crate) fn shortest_s(&self) -> f64 {
        self.at(0.0).min(self.at(1000.0))
    }
}

/// The inverse of the rate, scaled for the tick.
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
    /// Of a time constant of two sample times or more at all voltages, the shortest at least a twentieth of the longest.
    pub(crate) fn new(tau: &TimeConstant, sample_time: SampleTime) -> Self {
        let inverse = |volts| -1.0 / libm::expm1(-sample_time.seconds() / tau.at(volts));
        let (end_v, at_zero) = (tau.end_v(), inverse(0.0));
        let longest = at_zero.max(inverse(end_v));
        let mut shift = 0;
        while libm::ldexp(longest, 24 - shift) >= libm::ldexp(1.0, 31) {
            shift += 1;
        }
        let per_volt = (inverse(end_v) - at_zero) / end_v;
        Self {
            at_zero: libm::round(libm::ldexp(at_zero, 24 - shift)) as i32,
            per_volt: libm::round(libm::ldexp(per_volt, 24 - shift + MORE_BITS as i32)) as i32,
            end: Signal::from_num(end_v),
            shift: shift as u8,
        }
    }

    /// What one tick at `voltage` adds for `lag`.
    #[inline(always)]
    pub(crate) fn step(&self, voltage: Signal, lag: Signal) -> Accumulator {
        let voltage = voltage.max(Signal::ZERO).min(self.end);
        let more = (i64::from(voltage.to_bits()) * i64::from(self.per_volt)) >> (Signal::FRAC_NBITS + MORE_BITS);
        // 25.6 to 31 bits, so that the guess of its inverse has at least 15 and the rate below at most 30.4.
        let inverse = self.at_zero + more as i32;
        let guess = (1u32 << 31).checked_div(inverse as u32 >> 15).unwrap_or(0);
        let missing = (1 << 46) - i64::from(inverse) * i64::from(guess);
        let rate = (i64::from(guess) << 10) + ((i64::from(guess) * (missing >> 20)) >> 16);
        // 2^56 / inverse, times the lag in 2^-20: scaled back to 2^-52.
        Accumulator::from_bits((i64::from(lag.to_bits()) * i64::from(rate as i32)) >> self.shift)
    }
}
