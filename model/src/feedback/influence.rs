//! How much of an innovation counts: Huber's bounded influence, with bounds that know where the model came from.
//!
//! At rest an innovation counts as far as `6 noise_v`. While the model moves, both a wrong model and one that only lacks a
//! lag (a slew, a delay, a mode) are off by much more, but not on the same side:
//!
//! - A spring **behind** its model may just be late. An answer to that drives it too far once it comes, so no more counts
//!   than at rest: the correction goes by at most `6 noise_v L` a reading.
//! - A spring **ahead** of its model overshoots now, and must be answered now: as far as the model has moved of late counts.
//!   But not if the spring was behind by more than `6 noise_v` of late: that is a swing, which the haste would excite.
//!
//! ```text
//! -(6 noise_v + upper - y) <= nu <= 6 noise_v + y - lower      (lower, upper: the model's envelope, y: the model)
//! ```

use super::envelope::{self, Envelope};
use crate::units::Signal;

/// For one interval between readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config {
    envelope: envelope::Config,
    noise: Signal,
}

/// Of the innovations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State(Envelope);

impl Config {
    /// `noise` is what a reading may be off at rest.
    pub(super) fn new(interval_s: f64, noise: Signal) -> Self {
        Self { envelope: envelope::Config::new(interval_s), noise }
    }

    /// What counts of an innovation while the model is at `model` and has covered what `moved` says.
    #[inline]
    pub(super) fn bounded(&self, state: &mut State, innovation: Signal, model: Signal, moved: &Envelope) -> Signal {
        self.envelope.follow(&mut state.0, innovation);
        let (fallen_behind, risen_behind) = state.0.beside(Signal::ZERO);
        let (risen, fallen) = moved.beside(model);
        let bound = |ahead, behind| {
            let haste = if behind > self.noise { Signal::ZERO } else { ahead };
            self.noise.saturating_add(haste)
        };
        innovation.max(-bound(fallen, risen_behind)).min(bound(risen, fallen_behind))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: f64 = 6.0;

    /// What counts of these innovations, to the volt, the model gone from 0 to 100 V in between.
    fn counted<const N: usize>(innovations: [f64; N]) -> [f64; N] {
        let config = Config::new(1e-3, Signal::from_num(NOISE));
        let (mut state, mut moved) = (State::default(), Envelope::default());
        let model = Signal::from_num(100);
        envelope::Config::new(1e-3).follow(&mut moved, model);
        innovations.map(|nu| config.bounded(&mut state, Signal::from_num(nu), model, &moved).to_num::<f64>().round())
    }

    #[test]
    fn ahead_counts_behind_waits_and_a_swing_is_not_excited() {
        assert_eq!(counted([50.0]), [50.0]);
        assert_eq!(counted([200.0]), [NOISE + 100.0]);
        assert_eq!(counted([-50.0]), [-NOISE]);
        assert_eq!(counted([-50.0, 50.0]), [-NOISE, NOISE]);
        // Noise is no swing.
        assert_eq!(counted([-5.0, 50.0]), [-5.0, 50.0]);
    }
}
