//! Detection of a delay between the model and the spring, at the beginning of each quick movement.
//!
//! A part of every change of the voltage changes the stiffness without delay, the instantaneous share. A spring that is delayed, follows
//! behind a lag or an amplifier with a slow response, or oscillates, has not moved yet when its model has; a spring whose time constant,
//! gain or share is another one has moved by less, but has moved. Later in a movement they look alike.
//!
//! - *prompt*: when the model had moved by `12 noise_v`, the spring had not been behind by more than half of that.
//! - A movement is quick if the model covers the second half of these `12 noise_v` within [`READINGS`] readings: in a slow one every spring
//!   keeps up with its model.
//! - A prompt spring that is more than `4.5 noise_v` behind and more than that ahead within 0.5 s oscillates: it is not prompt any more.
//!
//! The spring is rated once for each movement, until the model has come back to within `6 noise_v` of its recent range.

use crate::units::Signal;

/// Most readings in which the model moves from `6 noise_v` to `12 noise_v`.
const READINGS: u8 = 8;

/// What is known of the spring in the present movement of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Response {
    /// The model rests.
    #[default]
    Rest,
    /// The model began to move this number of readings ago.
    Begun(u8),
    /// The spring follows its model without delay.
    Prompt,
    /// The spring may be delayed, or the model moves too slowly to show it.
    Unknown,
}

impl Response {
    /// Returns the response after one reading, for a model that has moved by `moved`, and a spring that was behind it by up to `behind`,
    /// and ahead of it by up to `ahead`; `noise` is `6 noise_v`, all in V.
    #[inline]
    pub(super) fn after(self, moved: Signal, behind: Signal, ahead: Signal, noise: Signal) -> Self {
        let is_far = moved > noise.saturating_add(noise);
        match self {
            _ if moved <= noise => Self::Rest,
            Self::Rest | Self::Begun(_) if is_far => {
                if behind <= moved >> 1 {
                    Self::Prompt
                } else {
                    Self::Unknown
                }
            }
            Self::Rest => Self::Begun(0),
            Self::Begun(readings) if readings < READINGS => Self::Begun(readings.saturating_add(1)),
            Self::Begun(_) => Self::Unknown,
            Self::Prompt if behind.min(ahead) > noise.saturating_sub(noise >> 2) => Self::Unknown,
            known => known,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE_V: f64 = 6.0;

    /// The response after the model has moved by `per_reading` in each of 20 readings, where the spring is behind by `behind` of what the
    /// model has moved by.
    fn of(per_reading: f64, behind: impl Fn(f64) -> f64) -> Response {
        let after = |response: Response, reading: i32| {
            let moved = per_reading * f64::from(reading);
            let [moved, behind, noise] = [moved, behind(moved), NOISE_V].map(Signal::from_num);
            response.after(moved, behind, Signal::ZERO, noise)
        };
        (1..=20).fold(Response::Rest, after)
    }

    #[test]
    fn a_spring_with_another_time_constant_is_prompt_and_a_delayed_one_is_not() {
        assert_eq!(of(1.8, |_| 0.0), Response::Prompt);
        assert_eq!(of(1.8, |moved| 0.45 * moved), Response::Prompt, "almost half of it is missing");
        assert_eq!(of(1.8, |moved| 0.55 * moved), Response::Unknown);
        // Two and five readings late, which is 0.3 and 0.8 of 12 V.
        assert_eq!(of(1.8, |moved| moved.min(2.0 * 1.8)), Response::Prompt);
        assert_eq!(of(1.8, |moved| moved.min(5.0 * 1.8)), Response::Unknown);
        assert_eq!(of(90.0, |_| 0.0), Response::Prompt, "all in one reading");
        assert_eq!(of(90.0, |moved| moved.min(90.0)), Response::Unknown);
    }

    /// Every spring keeps up with a slow model.
    #[test]
    fn a_slow_movement_shows_no_delay() {
        assert_eq!(of(0.8, |_| 0.0), Response::Prompt);
        assert_eq!(of(0.6, |_| 0.0), Response::Unknown);
    }

    #[test]
    fn a_movement_is_rated_once_and_the_next_one_anew() {
        let [noise, far] = [NOISE_V, 20.0].map(Signal::from_num);
        for known in [Response::Prompt, Response::Unknown] {
            assert_eq!(known.after(far, Signal::ZERO, far, noise), known);
            assert_eq!(known.after(far, far, Signal::ZERO, noise), known);
            assert_eq!(known.after(noise, Signal::ZERO, Signal::ZERO, noise), Response::Rest);
        }
        assert_eq!(Response::default(), Response::Rest);
    }

    #[test]
    fn a_spring_that_oscillates_is_not_prompt_any_more() {
        let [noise, bound, more] = [NOISE_V, 4.5, 4.6].map(Signal::from_num);
        let after = |behind, ahead| Response::Prompt.after(Signal::from_num(20), behind, ahead, noise);
        assert_eq!(after(more, bound), Response::Prompt);
        assert_eq!(after(bound, more), Response::Prompt);
        assert_eq!(after(more, more), Response::Unknown);
    }
}
