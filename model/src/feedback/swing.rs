//! Whether the correction shakes the spring.
//!
//! Around a spring with a mode that the model lacks, too large a gain makes a swing that grows (see [`super`], stability).
//! No reading of it is wrong; what gives it away is a mismatch that goes from one side of its own mean to the other again and
//! again, while nobody asks for it: by more than `6 noise_v` and twice the range that the *target* has covered of late, and
//! without dying down. After [`SWINGS`] such crossings, none later than [`PAUSE_S`] after the one before, the gain is
//! quartered, up to [`MOST`] times. It stays so until a configuration is adopted: the mode does not go away. A hum on the
//! readings is answered in the same way, and rightly so.

use super::envelope::{self, Envelope};
use crate::coefficient::{Rate, upper};
use crate::units::{Accumulator, SampleTime, Signal, part_of_way};

/// Crossings that quarter the gain.
pub const SWINGS: u8 = 6;
/// The longest time between two of them, in s.
pub const PAUSE_S: f64 = 2.0;
/// Quarterings at the most.
pub const MOST: u8 = 3;

/// For one interval between readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config {
    envelope: envelope::Config,
    mean: Rate,
    pause: u32,
}

/// What is remembered of the swing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    /// Of the target.
    envelope: Envelope,
    mean: Accumulator,
    above: bool,
    /// How far it went on this side so far, and on the other side before.
    reach: Signal,
    last_reach: Signal,
    crossings: u8,
    since: u32,
    quartered: u8,
}

impl Config {
    pub(super) fn new(interval_s: f64, sample_time: SampleTime) -> Self {
        let envelope = envelope::Config::new(sample_time.seconds());
        Self { envelope, mean: Rate::new(part_of_way(interval_s, PAUSE_S)), pause: (PAUSE_S / interval_s) as u32 }
    }

    /// In this tick `target` is asked for.
    #[inline]
    pub(super) fn asked(&self, state: &mut State, target: Signal) {
        self.envelope.follow(&mut state.envelope, target);
    }

    /// Hears of a believed reading; `noise` is what it may be off at rest.
    #[inline]
    pub(super) fn hear(&self, state: &mut State, mismatch: Signal, noise: Signal) {
        let gate = state.envelope.gate(noise);
        let away = mismatch.saturating_sub(upper(state.mean));
        state.mean = state.mean.saturating_add(self.mean.step(away));
        state.since = state.since.saturating_add(1);
        if state.since > self.pause {
            state.crossings = 0;
        }
        state.reach = state.reach.max(away.saturating_abs());
        let crossed = if state.above { away < -gate } else { away > gate };
        if crossed {
            (state.above, state.since) = (!state.above, 0);
            // A swing that dies down by itself is none of the loop's.
            let dies = state.reach < state.last_reach.saturating_sub(state.last_reach >> 4);
            (state.reach, state.last_reach) = (Signal::ZERO, state.reach);
            state.crossings = state.crossings.saturating_add(u8::from(!dies));
            if state.crossings >= SWINGS && state.quartered < MOST {
                (state.crossings, state.quartered) = (0, state.quartered.saturating_add(1));
            }
        }
    }
}

impl State {
    /// What is left of a step of the correction.
    #[inline]
    pub(super) fn soften(&self, step: Accumulator) -> Accumulator {
        Accumulator::from_bits(step.to_bits() >> (2 * self.quartered))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How often the gain is quartered by a mismatch that goes from one side to the other every `half_s`, each time to
    /// `shrinks` of what it was.
    fn quartered(half_s: f64, shrinks: f64, sides: u32) -> u8 {
        let config = Config::new(1e-3, SampleTime::from_rate(1000.0).unwrap());
        let mut state = State::default();
        let target = Signal::from_num(300);
        // At rest for long.
        (0..20_000).for_each(|_| config.asked(&mut state, target));
        let mut amplitude = 200.0;
        for _ in 0..sides {
            for _ in 0..(half_s * 1e3) as u32 {
                config.asked(&mut state, target);
                config.hear(&mut state, Signal::from_num(amplitude), Signal::from_num(6));
            }
            amplitude *= -shrinks;
        }
        state.quartered
    }

    #[test]
    fn a_swing_that_stays_is_calmed_one_that_dies_or_dawdles_is_not() {
        let six = u32::from(SWINGS);
        assert_eq!(quartered(0.05, 1.0, six - 1), 0);
        // The first sides are still larger than the mean that follows them.
        assert_eq!(quartered(0.05, 1.0, six + 3), 1);
        assert_eq!(quartered(0.05, 1.05, six + 3), 1);
        assert_eq!(quartered(0.05, 1.0, 100), MOST);
        assert_eq!(quartered(0.05, 0.8, 100), 0);
        assert_eq!(quartered(1.2 * PAUSE_S, 1.0, 100), 0);
    }
}
