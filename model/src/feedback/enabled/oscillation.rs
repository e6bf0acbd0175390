//! Detection of an oscillation that the correction excites, and reduction of its gain.
//!
//! Important terms:
//!
//! - *mean*: a low-pass of the mismatch with the time constant [`PAUSE_S`], in V.
//! - *gate*: `6 noise_v` plus twice the range that the *target* has covered recently, in V.
//! - *crossing*: the mismatch goes from more than a gate below its mean to more than a gate above it, or back.
//!
//! With a spring that has a mode which the model lacks, too large a gain makes an oscillation grow
//! ([`crate::feedback`], stability). None of its readings is wrong. It is detected by a mismatch that crosses its own
//! mean again and again while the target rests, and does not decay: after [`SWINGS`] crossings, none later than
//! [`PAUSE_S`] after the previous one, the gain is divided by four, up to [`MAX_REDUCTIONS`] times. It stays reduced
//! until the next bumpless transfer, because the mode stays. Hum on the readings has the same effect, and the same
//! remedy.

use super::envelope::{self, Envelope};
use crate::coefficient::{Rate, upper};
use crate::units::{Accumulator, SampleTime, Signal, lag_fraction};

/// Number of crossings after which the gain is divided by four.
pub const SWINGS: u8 = 6;
/// Longest time between two crossings of one oscillation, in s.
pub const PAUSE_S: f64 = 2.0;
/// Number of times that the gain may be divided by four.
pub const MAX_REDUCTIONS: u8 = 3;

/// The detector for one interval between readings, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config {
    envelope: envelope::Config,
    mean: Rate,
    /// `PAUSE_S`, in readings.
    pause: u32,
}

/// State of the detector; the default is that of a target and a mismatch that have always been 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    /// Envelope of the target.
    envelope: Envelope,
    mean: Accumulator,
    above: bool,
    /// Largest deviation from the mean since the last crossing, and between the two crossings before it.
    amplitude: Signal,
    last_amplitude: Signal,
    crossings: u8,
    /// Readings since the last crossing.
    since: u32,
    reductions: u8,
}

impl Config {
    pub(super) fn new(interval_s: f64, sample_time: SampleTime) -> Self {
        let envelope = envelope::Config::new(sample_time.seconds());
        Self { envelope, mean: Rate::new(lag_fraction(interval_s, PAUSE_S)), pause: (PAUSE_S / interval_s) as u32 }
    }

    /// Advances the target's envelope by one tick.
    #[inline]
    pub(super) fn track_target(&self, state: &mut State, target: Signal) {
        self.envelope.track(&mut state.envelope, target);
    }

    /// Processes the mismatch of one accepted reading; `noise` is `6 noise_v`, in V.
    #[inline]
    pub(super) fn detect(&self, state: &mut State, mismatch: Signal, noise: Signal) {
        let gate = state.envelope.gate(noise);
        let deviation = mismatch.saturating_sub(upper(state.mean));
        state.mean = state.mean.saturating_add(self.mean.step(deviation));
        state.since = state.since.saturating_add(1);
        if state.since > self.pause {
            state.crossings = 0;
        }
        state.amplitude = state.amplitude.max(deviation.saturating_abs());
        let crossed = if state.above { deviation < -gate } else { deviation > gate };
        if crossed {
            (state.above, state.since) = (!state.above, 0);
            // An oscillation that decays by itself is not excited by the loop.
            let decays = state.amplitude < state.last_amplitude.saturating_sub(state.last_amplitude >> 4);
            (state.amplitude, state.last_amplitude) = (Signal::ZERO, state.amplitude);
            state.crossings = state.crossings.saturating_add(u8::from(!decays));
            if state.crossings >= SWINGS && state.reductions < MAX_REDUCTIONS {
                (state.crossings, state.reductions) = (0, state.reductions.saturating_add(1));
            }
        }
    }
}

impl State {
    /// Returns a step of the correction with the gain reduced.
    #[inline]
    pub(super) fn reduce(&self, step: Accumulator) -> Accumulator {
        Accumulator::from_bits(step.to_bits() >> (2 * self.reductions))
    }

    /// The state after as many reductions of the gain.
    #[cfg(test)]
    pub(super) fn reduced(reductions: u8) -> Self {
        Self { reductions, ..Self::default() }
    }
}

#[cfg(test)]
mod tests;
