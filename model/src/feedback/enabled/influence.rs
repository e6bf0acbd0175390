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
//!
//! The robust pre-compensator raises its voltage step by step, so that readings show the error of the model before the target is
//! reached. With it ([`Config::is_quick`]) they are used without the delay of the gain `L`:
//!
//! - Two innovations in a row that are ahead by more than `1.5 noise_v` while the model moves are no noise, and no single wrong reading:
//!   three quarters of the smaller one are added to the correction with the second. So are three quarters of the mean of the last
//!   innovations, each clipped to `3 noise_v`, if that exceeds `0.75 noise_v`: twice its own standard deviation, and what a single wrong
//!   reading gives it at most.
//! - A correction for a spring that was **behind** is taken back in the same way, at most to 0 V, once the spring has caught up. A spring
//!   that is late, because of a lag, a slow amplifier or a smaller share, would otherwise be driven beyond its target by what its delay
//!   has added. A correction that goes to 0 V excites nothing: the loop is that of the model alone then.
//! - For an innovation that takes a correction back, the bound is wider by that correction.
//! - A spring that is **prompt** ([`response`](super::response)) is not late when it is behind, but slower or smaller than its model. A
//!   sixteenth of each innovation, clipped to `6 noise_v`, is added without delay as long as the model has moved recently: the correction
//!   has a time constant of 16 readings. Two innovations in a row have to be ahead by more than `3 noise_v` unless they take a correction
//!   back, since smaller ones are corrected quickly anyway, and with less noise.

use super::envelope::{self, Envelope};
use super::response::Response;
use crate::feedback::Observed;
use crate::units::Signal;

/// Number of binary digits by which an innovation of a prompt spring is divided: a sixteenth of it is added without delay.
pub(super) const PROMPT_SHIFT: u32 = 4;

/// Bounds for one interval between readings, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config {
    envelope: envelope::Config,
    noise: Signal,
    /// True if innovations that are ahead are used without delay.
    is_quick: bool,
}

/// Envelope of the innovations, the last one, and the mean of the last ones, of which each has a third of the weight of all before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    innovations: Envelope,
    last: Signal,
    mean: Signal,
}

/// What an innovation adds to the correction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Influence {
    /// The clipped innovation, of which the gain adds a part, in V.
    pub(super) clipped: Signal,
    /// Part of the innovation that is added without delay, in V.
    pub(super) quick: Signal,
    /// How the innovation was used.
    pub(super) observed: Observed,
}

impl State {
    /// Forgets the last innovations: those before a time without trust in the sensor say nothing about the ones after it.
    #[inline]
    pub(super) fn forget(&mut self) {
        (self.last, self.mean) = (Signal::ZERO, Signal::ZERO);
    }
}

impl Config {
    /// Quantizes the bounds; `noise` is the bound at rest, in V.
    pub(super) fn new(interval_s: f64, noise: Signal, is_quick: bool) -> Self {
        Self { envelope: envelope::Config::new(interval_s), noise, is_quick }
    }

    /// Returns what an innovation adds to the correction, for a model that is at `model` and has the envelope `recent`; all in V.
    #[inline]
    pub(super) fn of(
        &self,
        (state, response): (&mut State, &mut Response),
        innovation: Signal,
        correction: Signal,
        model: Signal,
        recent: &Envelope,
    ) -> Influence {
        self.envelope.track(&mut state.innovations, innovation);
        let last = core::mem::replace(&mut state.last, innovation);
        let (was_negative, was_positive) = state.innovations.distances(Signal::ZERO);
        let (risen, fallen) = recent.distances(model);
        // Upward: an innovation above 0 V; otherwise all signs are those of the mirrored signals.
        let up = innovation >= Signal::ZERO;
        let mirrored = |signal: Signal| if up { signal } else { signal.saturating_neg() };
        let (moved, behind) = if up { (risen, was_negative) } else { (fallen, was_positive) };
        let ahead = if behind > self.noise { Signal::ZERO } else { moved };
        let size = mirrored(innovation);
        if !self.is_quick {
            let clipped = mirrored(size.min(self.noise.saturating_add(ahead)));
            return Influence { clipped, quick: Signal::ZERO, observed: Observed::Reading };
        }
        let (far, late, early) =
            if risen > fallen { (risen, was_negative, was_positive) } else { (fallen, was_positive, was_negative) };
        *response = response.after(far, late, early, self.noise);
        let is_prompt = *response == Response::Prompt;
        let back = mirrored(correction).saturating_neg().max(Signal::ZERO);
        let bound = self.noise.saturating_add(ahead).saturating_add(back);
        let bounded = mirrored(size.min(self.noise >> 1));
        state.mean = state.mean.saturating_add(bounded.saturating_sub(state.mean) >> 2);
        let (twice, mean) = (size.min(mirrored(last)), mirrored(state.mean));
        let least = if is_prompt && back == Signal::ZERO { self.noise >> 1 } else { self.noise >> 2 };
        let shown = if twice > least { twice } else { mean };
        let used = shown.min(ahead.max(back.min(moved)));
        let quick = if moved > self.noise && used > self.noise >> 3 { used - (used >> 2) } else { Signal::ZERO };
        state.mean = mirrored(mean.saturating_sub(quick).max(mean.min(Signal::ZERO)));
        let observed = match is_prompt {
            _ if quick != Signal::ZERO => Observed::Ahead,
            true => Observed::Prompt,
            false => Observed::Reading,
        };
        let prompt = if is_prompt { size.min(self.noise) >> PROMPT_SHIFT } else { Signal::ZERO };
        Influence { clipped: mirrored(size.min(bound)), quick: mirrored(quick.saturating_add(prompt)), observed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: f64 = 6.0;

    /// What each of these innovations adds to a correction in V, clipped and without delay, while the model has moved from 0 V to there.
    fn after<const N: usize>(moved: f64, is_quick: bool, correction: f64, innovations: [f64; N]) -> [(f64, f64); N] {
        after_in(Response::Unknown, moved, is_quick, correction, innovations)
    }

    /// The same for a spring of which this is known.
    fn after_in<const N: usize>(
        mut response: Response,
        moved: f64,
        is_quick: bool,
        correction: f64,
        innovations: [f64; N],
    ) -> [(f64, f64); N] {
        let config = Config::new(1e-3, Signal::from_num(NOISE), is_quick);
        let (mut state, mut recent) = (State::default(), Envelope::default());
        let (model, correction) = (Signal::from_num(moved), Signal::from_num(correction));
        envelope::Config::new(1e-3).track(&mut recent, model);
        innovations.map(|nu| {
            let Influence { clipped, quick, .. } =
                config.of((&mut state, &mut response), Signal::from_num(nu), correction, model, &recent);
            (clipped.to_num::<f64>().round(), quick.to_num())
        })
    }

    /// What each of these innovations adds to a correction in V, clipped and without delay, while the model has moved by 100 V.
    fn of<const N: usize>(is_quick: bool, correction: f64, innovations: [f64; N]) -> [(f64, f64); N] {
        after(100.0, is_quick, correction, innovations)
    }

    /// The clipped innovations; rounded to 1 V.
    fn clipped<const N: usize>(innovations: [f64; N]) -> [f64; N] {
        of(false, 0.0, innovations).map(|(clipped, quick)| {
            assert_eq!(quick, 0.0);
            clipped
        })
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

    #[test]
    fn two_innovations_ahead_are_used_without_delay_and_one_is_not() {
        let quick = |innovations| of(true, 0.0, innovations).map(|(_, quick)| quick);
        // Three quarters of the smaller one.
        assert_eq!(quick([20.0, 16.0, -1.0, 16.0]), [0.0, 12.0, 0.0, 0.0]);
        // Their mean, 1.25 (1 - 0.75^4), exceeds 0.75 V with the fourth.
        assert_eq!(quick([1.25, 1.25, 1.25, 1.25]), [0.0, 0.0, 0.0, 0.75 * 1.25 * (1.0 - 81.0 / 256.0)]);
        assert_eq!(quick([-5.0, -5.0, -5.0, -5.0]), [0.0; 4], "behind");
        assert_eq!(quick([-20.0, 8.0, 8.0, 8.0]), [0.0; 4], "behind recently");
        let quick_after = |moved| after(moved, true, 0.0, [20.0, 20.0])[1].1;
        assert_eq!(quick_after(NOISE - 1.0), 0.0, "the model moves by less than the noise");
        let quick = quick_after(NOISE + 2.0);
        assert!((5.9..6.0).contains(&quick), "three quarters of what it has moved by, not {quick} V");
    }

    /// One step of a signal more is beyond each bound.
    #[test]
    fn at_its_bound_an_innovation_is_no_larger_than_the_noise() {
        let step = f64::from(Signal::from_bits(1));
        assert_eq!(of(true, 0.0, [1.5, 1.5])[1].1, 0.0);
        assert!(of(true, 0.0, [1.5 + step, 1.5 + step])[1].1 > 1.0);
        let config = Config::new(1e-3, Signal::from_num(NOISE), true);
        for (moved, is_quick) in [(NOISE, false), (NOISE + step, true)] {
            // Without the tick in which the envelope already returns.
            let (mut state, model, recent) = (State::default(), Signal::from_num(moved), Envelope::default());
            let mut of = || {
                let state = (&mut state, &mut Response::Unknown);
                config.of(state, Signal::from_num(20), Signal::ZERO, model, &recent).quick
            };
            of();
            assert_eq!(of() > Signal::ZERO, is_quick, "{moved} V");
        }
    }

    /// The lower envelope of the innovations has returned to exactly that by the second one.
    #[test]
    fn an_innovation_that_was_behind_by_the_noise_still_has_the_wider_bound() {
        let config = Config::new(1e-3, Signal::from_num(NOISE), false);
        let (model, mut recent) = (Signal::from_num(100), Envelope::default());
        envelope::Config::new(1e-3).track(&mut recent, model);
        let mut found = 0;
        for bits in 0..4000 {
            let mut state = State::default();
            let mut of =
                |nu: Signal| config.of((&mut state, &mut Response::Unknown), nu, Signal::ZERO, model, &recent).clipped;
            of(Signal::from_bits(bits) - Signal::from_num(6.114));
            let clipped = of(Signal::from_num(50));
            let behind = state.innovations.distances(Signal::ZERO).0;
            if behind == Signal::from_num(NOISE) {
                assert_eq!(clipped, Signal::from_num(50));
                found += 1;
            } else if behind > Signal::from_num(NOISE) {
                assert_eq!(clipped, Signal::from_num(NOISE));
            }
        }
        assert!(found > 0);
    }

    #[test]
    fn a_correction_for_a_spring_that_was_behind_is_taken_back_without_delay_but_not_beyond_0() {
        assert_eq!(of(true, -4.0, [-20.0, 8.0, 8.0]), [(-6.0, 0.0), (8.0, 0.0), (8.0, 3.0)]);
        assert_eq!(of(true, -40.0, [-20.0, 60.0, 60.0]), [(-6.0, 0.0), (46.0, 0.0), (46.0, 30.0)]);
        assert_eq!(of(false, -40.0, [-20.0, 60.0, 60.0]), [(-6.0, 0.0), (6.0, 0.0), (6.0, 0.0)]);
    }

    /// The model has moved by 100 V within one reading.
    #[test]
    fn a_spring_that_answered_without_delay_is_corrected_more_quickly_both_ways() {
        fn prompt<const N: usize>(correction: f64, innovations: [f64; N]) -> [(f64, f64); N] {
            after_in(Response::Rest, 100.0, true, correction, innovations)
        }
        // A sixteenth of at most 6 V; behind, the rest is clipped as ever.
        assert_eq!(prompt(0.0, [-4.0, -4.0, 2.0, -80.0]), [(-4.0, -0.25), (-4.0, -0.25), (2.0, 0.125), (-6.0, -0.375)]);
        // Behind, then ahead: an oscillation.
        assert_eq!(prompt(0.0, [-40.0, 8.0, 8.0]), [(-6.0, -0.375), (6.0, 0.0), (6.0, 0.0)]);
        // Two of 2 V are less than 3 V; they take a correction back as they do for any spring.
        assert_eq!(prompt(0.0, [2.0, 2.0]).map(|(_, quick)| quick), [0.125, 0.125 + 0.75 * 0.875]);
        assert_eq!(prompt(-40.0, [2.0, 2.0]).map(|(_, quick)| quick), [0.125, 0.125 + 1.5]);
        // Late, or at rest.
        assert_eq!(prompt(0.0, [-60.0, -60.0]).map(|(_, quick)| quick), [0.0; 2]);
        assert_eq!(after_in(Response::Rest, 5.0, true, 0.0, [-4.0, -4.0]).map(|(_, quick)| quick), [0.0; 2]);
    }
}
