//! A finished run of the fixed-point loop, one sample per tick.

use model::{DacCode, Limits, ScaledStiffness, Volts};

/// One tick of one loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Code sent to the DAC.
    pub code: DacCode,
    /// Voltage of that code.
    pub applied: Volts,
    /// Fixed-point estimate of the stiffness just after the voltage was applied.
    pub stiffness: ScaledStiffness,
    /// Limits that acted.
    pub limits: Limits,
    /// Stiffness of the reference at the same time, in V.
    pub reference: f64,
}

/// A finished run, first and last tick included.
#[derive(Clone, Debug)]
pub struct Run {
    /// Time of the first tick, in s.
    pub start_s: f64,
    /// Ticks per second, in Hz.
    pub rate_hz: f64,
    /// The loop with the pre-compensator.
    pub with: Vec<Sample>,
    /// The loop without it: the target is the voltage.
    pub without: Vec<Sample>,
}

impl Run {
    /// Time of a tick, in s.
    pub fn time_s(&self, tick: usize) -> f64 {
        self.start_s + tick as f64 / self.rate_hz
    }

    /// Index of the last tick at or before `time_s`.
    pub fn tick_at(&self, time_s: f64) -> usize {
        let tick = ((time_s - self.start_s) * self.rate_hz + 1e-6).floor().max(0.0) as usize;
        tick.min(self.with.len() - 1)
    }
}
