//! A finished run of the fixed-point loop: one sample a tick.

use model::{DacCode, Limits, ScaledStiffness, Volts};

/// One tick of one loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// What the DAC was told.
    pub code: DacCode,
    /// The voltage of that code.
    pub applied: Volts,
    /// The fixed-point estimate just after.
    pub stiffness: ScaledStiffness,
    /// The limits that acted.
    pub limits: Limits,
    /// The reference's stiffness at the same moment, in V.
    pub reference: f64,
}

/// A finished run: one sample a tick, first and last moment included.
#[derive(Clone, Debug)]
pub struct Run {
    /// Time of the first tick, in s.
    pub start_s: f64,
    /// Ticks per second.
    pub rate_hz: f64,
    /// With the pre-compensator.
    pub with: Vec<Sample>,
    /// The target put out as it is.
    pub without: Vec<Sample>,
}

impl Run {
    /// Time of a tick, in s.
    pub fn time_s(&self, tick: usize) -> f64 {
        self.start_s + tick as f64 / self.rate_hz
    }

    /// The last tick at or before `time_s`.
    pub fn tick_at(&self, time_s: f64) -> usize {
        let tick = ((time_s - self.start_s) * self.rate_hz + 1e-6).floor().max(0.0) as usize;
        tick.min(self.with.len() - 1)
    }
}
