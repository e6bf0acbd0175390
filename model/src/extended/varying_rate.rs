//! A relaxation whose time constant depends on the voltage.
//!
//! ```text
//! tau(v) = low + (high - low) v / 500 V     for v >= 0; beyond 500 V it goes on, but not below half of the shorter one
//! ```
//!
//! What part of its distance a lag makes in a tick, `1 - exp(-T / tau(v))`, is tabled exactly every 16 V and straight
//! between. The curve is close to `T / tau(v)`, so the line is too high by less than `h^2 / 8` of its second derivative:
//! `64 V^2 (slope / tau)^2` of itself, with `slope` in s/V. From 5.5 s to 8 s that is 5e-5, from 2 s to 10 s 4e-3 near 0 V
//! and 2e-4 at 400 V. A rate that is off by a part `e` puts a step's response off by less than `e / 2.7` of the step.

use crate::units::{Accumulator, Signal};

/// Fraction bits of a signal between two entries: 16 V.
const WITHIN: u32 = Signal::FRAC_NBITS + 4;
/// Intervals up to 1024 V.
const INTERVALS: usize = 64;

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
        (self.low_s + (self.high_s - self.low_s) * volts.max(0.0) / 500.0).max(0.5 * self.low_s.min(self.high_s))
    }

    /// The shortest at any voltage of an amplifier.
    pub(crate) fn shortest_s(&self) -> f64 {
        self.at(0.0).min(self.at(1000.0))
    }
}

/// The table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct VaryingRate {
    /// Rates in 2^-(32 + shift).
    entries: [i32; INTERVALS + 1],
    shift: u32,
}

impl VaryingRate {
    /// Of rates of 0 up to but not including 1/2.
    pub(crate) fn new(rate: impl Fn(f64) -> f64) -> Self {
        let volts = |entry: usize| entry as f64 * (1 << (WITHIN - Signal::FRAC_NBITS)) as f64;
        let highest = (0..=INTERVALS).map(|entry| rate(volts(entry))).fold(0.0, f64::max);
        let mut shift = 0;
        while libm::ldexp(highest, 33 + shift) < f64::from(i32::MAX) && shift < 31 {
            shift += 1;
        }
        let mut entries = [0; INTERVALS + 1];
        for (entry, value) in entries.iter_mut().enumerate() {
            *value = libm::round(libm::ldexp(rate(volts(entry)), 32 + shift)) as i32;
        }
        Self { entries, shift: shift as u32 }
    }

    /// What one tick at `voltage` adds for `lag`.
    #[inline(always)]
    pub(crate) fn step(&self, voltage: Signal, lag: Signal) -> Accumulator {
        let place = voltage.to_bits().max(0).min((INTERVALS as i32) * (1 << WITHIN) - 1);
        let entry = (place >> WITHIN) as usize % INTERVALS;
        let (from, to) = (self.entries[entry], self.entries[entry + 1]);
        let within = i64::from(place & ((1 << WITHIN) - 1));
        let rate = from + ((within * i64::from(to - from)) >> WITHIN) as i32;
        Accumulator::from_bits((i64::from(lag.to_bits()) * i64::from(rate)) >> self.shift)
    }
}
