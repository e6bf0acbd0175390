//! Clipping of the innovation: Huber's bounded influence, with bounds that depend on the model's recent movement.
//!
//! Important terms:
//!
//! - *behind*: the spring has not yet covered the model's recent movement.
//! - *ahead*: the spring has moved further than the model, in the same direction.
//!
//! At rest an innovation is clipped at +-`6 noise_v`. While the model moves, both a wrong model and one that only lacks
//! a lag (a slew, a delay, a mode) are wrong by much more, but not on the same side:
//!
//! - A spring **behind** its model may only be late. A correction for that would drive it too far when it arrives, so
//!   the bound is the same as at rest: the correction changes by at most `6 noise_v L` per reading.
//! - A spring **ahead** of its model overshoots now and must be corrected now: the bound is wider by the model's recent
//!   movement. It is not if the spring was behind by more than `6 noise_v` recently: that is an oscillation, which a
//!   fast correction would excite.
//!
//! ```text
//! -(6 noise_v + upper - y) <= nu <= 6 noise_v + y - lower      (lower, upper: the model's envelope, y: the model)
//! ```

use super::envelope::{self, Envelope};
use crate::units::Signal;

/// Bounds for one interval between readings, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config {
    envelope: envelope::Config,
    noise: Signal,
}

/// Envelope of the innovations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State(Envelope);

impl Config {
    /// Quantizes the bounds; `noise` is the bound at rest, in V.
    pub(super) fn new(interval_s: f64, noise: Signal) -> Self {
        Self { envelope: envelope::Config::new(interval_s), noise }
    }

    /// Returns the clipped innovation, in V, for a model that is at `model` and has the envelope `recent`.
    #[inline]
    pub(super) fn clip(&self, state: &mut State, innovation: Signal, model: Signal, recent: &Envelope) -> Signal {
        self.envelope.track(&mut state.0, innovation);
        let (was_negative, was_positive) = state.0.distances(Signal::ZERO);
        let (risen, fallen) = recent.distances(model);
        let bound = |moved, opposite| {
            let ahead = if opposite > self.noise { Signal::ZERO } else { moved };
            self.noise.saturating_add(ahead)
        };
        innovation.max(-bound(fallen, was_positive)).min(bound(risen, was_negative))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: f64 = 6.0;

    /// Clips these innovations while the model has moved from 0 to 100 V; rounded to 1 V.
    fn clipped<const N: usize>(innovations: [f64; N]) -> [f64; N] {
        let config = Config::new(1e-3, Signal::from_num(NOISE));
        let (mut state, mut recent) = (State::default(), Envelope::default());
        let model = Signal::from_num(100);
        envelope::Config::new(1e-3).track(&mut recent, model);
        innovations.map(|nu| config.clip(&mut state, Signal::from_num(nu), model, &recent).to_num::<f64>().round())
    }

    #[test]
    fn an_innovation_ahead_has_a_wider_bound_unless_it_was_behind_recently() {
        assert_eq!(clipped([50.0]), [50.0]);
        assert_eq!(clipped([200.0]), [NOISE + 100.0]);
        assert_eq!(clipped([-50.0]), [-NOISE]);
        assert_eq!(clipped([-50.0, 50.0]), [-NOISE, NOISE]);
        // A deviation behind within the noise does not count as behind.
        assert_eq!(clipped([-5.0, 50.0]), [-5.0, 50.0]);
    }
}
