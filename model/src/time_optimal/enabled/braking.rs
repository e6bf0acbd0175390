//! Braking: when an amplifier of limited slew must begin to bring its voltage back.
//!
//! Important terms:
//!
//! - *drift*, `A`: the change of the stiffness in one tick while the voltage stays, in V.
//! - *slew step*, `S`: the largest change of the voltage in one tick, in V.
//! - *smallest step gain*: `h`, the change of the stiffness by the end of a tick for one volt more; `b`, the change
//!   that each later tick adds; `rho`, the fraction of its distance that the relaxation covers in a tick. All are the
//!   smallest that the spring has at any voltage.
//!
//! Bringing the voltage back by `S` per tick takes `h S` off the drift instantaneously and `b S` more with every later
//! tick, while the relaxation itself takes off a fraction `rho` of what is left. So the stiffness still covers, while
//! braking from a drift that exceeds `h S` by `p = A - h S`, the distance
//!
//! ```text
//! sum p = p^2 / (2 c),    c = b S + rho (h S + p / 2)
//! ```
//!
//! and at a distance `R` from the target the excess `p` may be `sqrt(2 c R)` at most. That is the braking parabola of
//! the proximate time-optimal servomechanism (M. L. Workman, 1987) with the spring's drift in place of a velocity. Once
//! `p <= 0` the inverse alone is slow enough. `rho` acts on all of `A`; `h S + p / 2` is its mean over the distance,
//! and less than its effect: the law brakes early rather than late.

use crate::coefficient::WideGain;
use crate::estimator::{Prediction, StepGain};
use crate::units::{Signal, TWO_TO_32, signal, steps};

/// The brake for one spring, slew and sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Braking {
    /// h S
    instantaneous: Signal,
    /// 2 S (b + rho h), in 2^-32 V
    twice: u64,
    /// rho, in 2^-32
    relaxation: u32,
    /// h / b
    per_drift: WideGain,
}

impl Braking {
    /// Quantizes the brake for a spring of this smallest step gain and a voltage that changes by at most `step_v` per
    /// tick.
    pub(super) fn new(smallest: &StepGain, step_v: f64) -> Self {
        let StepGain { feedthrough, in_one_tick, relaxation } = *smallest;
        let within = feedthrough + in_one_tick;
        Self {
            // Saturates if the slew is fast enough for any drift.
            instantaneous: signal(within * step_v),
            twice: steps(2.0 * step_v * (in_one_tick + relaxation * within), TWO_TO_32) as u64,
            relaxation: steps(relaxation, TWO_TO_32) as u32,
            per_drift: WideGain::new(within / in_one_tick.max(1e-9)),
        }
    }

    /// Returns the wanted `change` of the stiffness, reduced to what can still be braked before the target.
    #[inline(always)]
    pub(super) fn limit(&self, change: Signal, target: Signal, prediction: Prediction) -> Signal {
        let Prediction { now, end } = prediction;
        let drift = end.saturating_sub(now);
        let down = drift < Signal::ZERO;
        let mirrored = |signal: Signal| if down { signal.saturating_neg() } else { signal };
        let excess = mirrored(drift).saturating_sub(self.instantaneous);
        if excess <= Signal::ZERO {
            return change;
        }
        let distance = mirrored(target.saturating_sub(end)).max(Signal::ZERO);
        let twice =
            self.twice.saturating_add((excess.to_bits() as u64 * u64::from(self.relaxation)) >> Signal::FRAC_NBITS);
        // 32 and 20 fraction bits; 40 of them give a root with 20. If the product saturates, the brake is strict.
        let square = twice.saturating_mul(distance.to_bits() as u64) >> 12;
        let allowed = Signal::from_bits(root(square) as i32);
        mirrored(mirrored(change).min(self.per_drift.times(allowed.saturating_sub(excess))))
    }
}

/// Returns the square root, rounded down, of a number below 2^52, digit by digit.
#[inline(always)]
fn root(square: u64) -> u32 {
    let (mut root, mut rest, mut digit) = (0u64, square, 1u64 << 50);
    for _ in 0..26 {
        let tried = root | digit;
        root >>= 1;
        if rest >= tried {
            rest -= tried;
            root |= digit;
        }
        digit >>= 2;
    }
    root as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The limit is the braking parabola in double precision.
        #[test]
        fn the_limit_is_the_braking_parabola(
            (share, weight, relaxation) in (0.01..0.3f64, 0.3..1.0f64, 1e-4..1e-2f64),
            step_v in 0.1..2.0f64,
            (drift, distance, wanted) in (0.0..0.5f64, 0.0..200.0f64, 0.0..100.0f64),
            down: bool,
        ) {
            let (within, in_one_tick) = (share + weight * relaxation, weight * relaxation);
            let braking = Braking::new(&StepGain { feedthrough: share, in_one_tick, relaxation }, step_v);
            let signal = |volts: f64| Signal::from_num(if down { -volts } else { volts });
            let prediction = Prediction { now: signal(0.0), end: signal(drift) };
            let found = braking.limit(signal(wanted), signal(drift + distance), prediction).to_num::<f64>();

            let excess = drift - within * step_v;
            let braked = in_one_tick * step_v + relaxation * (within * step_v + excess / 2.0);
            let allowed = within / in_one_tick * ((2.0 * braked * distance).sqrt() - excess);
            let expected = if excess > 0.0 { wanted.min(allowed) } else { wanted };
            let found = if down { -found } else { found };
            prop_assert!((found - expected).abs() < 0.01 + 0.01 * expected.abs(), "{found} {expected}");
        }

        #[test]
        fn the_square_root_is_rounded_down(square in 0u64..1 << 52, fewer in 0u32..52) {
            let square = square >> fewer;
            prop_assert_eq!(u64::from(root(square)), square.isqrt());
        }
    }
}
