//! When an amplifier that slews slowly must begin to bring its voltage back.
//!
//! Held where it is, the voltage `u` lets the stiffness drift by `A` in a tick. Bringing it back by `S` a tick, the slew,
//! takes `h S` off that at once and `b S` more with every later tick, while the relaxation itself takes off a part `rho`
//! of what is left. So a drift of `p = A - h S` beyond what the slew makes up for goes on, braked, for
//!
//! ```text
//! sum p = p^2 / (2 c),    c = b S + rho (h S + p / 2)
//! ```
//!
//! and the drift that may be had at a distance `R` from the target is `sqrt(2 c R)`, no more. That is the braking parabola
//! of the proximate time-optimal servomechanism (M. L. Workman, 1987) with the spring's drift in the place of a velocity;
//! once `p <= 0` the inverse alone is slow enough. `rho` acts on all of `A`, of which `h S + p / 2` is the mean over the
//! way, and less than its effect: the brake comes early rather than late. `h`, `b`, `rho` are the least that the spring
//! has at any voltage.

use crate::coefficient::Steep;
use crate::estimator::{Outlook, Promptness};
use crate::units::{Signal, TWO_TO_32, signal, steps};

/// The brake for one spring, slew and sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Braking {
    /// h S
    at_once: Signal,
    /// 2 S (b + rho h), in 2^-32 V
    twice: u64,
    /// rho, in 2^-32
    relaxed: u32,
    /// h / b
    per_drift: Steep,
}

impl Braking {
    /// For a voltage that changes by at most `step_v` in a tick.
    pub(super) fn new(least: &Promptness, step_v: f64) -> Self {
        let Promptness { at_once, in_a_tick, relaxed } = *least;
        let within = at_once + in_a_tick;
        Self {
            // What no braking can take back is more than any signal.
            at_once: signal(within * step_v),
            twice: steps(2.0 * step_v * (in_a_tick + relaxed * within), TWO_TO_32) as u64,
            relaxed: steps(relaxed, TWO_TO_32) as u32,
            per_drift: Steep::new(within / in_a_tick.max(1e-9)),
        }
    }

    /// As much of a wanted `change` of the stiffness as can still be braked before the target.
    #[inline(always)]
    pub(super) fn limit(&self, change: Signal, target: Signal, outlook: Outlook) -> Signal {
        let Outlook { now, then } = outlook;
        let drift = then.saturating_sub(now);
        let down = drift < Signal::ZERO;
        let turned = |signal: Signal| if down { signal.saturating_neg() } else { signal };
        let beyond = turned(drift).saturating_sub(self.at_once);
        if beyond <= Signal::ZERO {
            return change;
        }
        let way = turned(target.saturating_sub(then)).max(Signal::ZERO);
        let twice =
            self.twice.saturating_add((beyond.to_bits() as u64 * u64::from(self.relaxed)) >> Signal::FRAC_NBITS);
        // 32 and 20 fraction bits; 40 of them make a root with 20. Too much, and the brake is strict.
        let square = twice.saturating_mul(way.to_bits() as u64) >> 12;
        let allowed = Signal::from_bits(root(square) as i32);
        turned(turned(change).min(self.per_drift.times(allowed.saturating_sub(beyond))))
    }
}

/// The square root, rounded down, of less than 2^52; digit by digit.
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
        /// The parabola of the module's text, in double precision.
        #[test]
        fn the_brake_is_the_parabola(
            (share, weight, relaxed) in (0.01..0.3f64, 0.3..1.0f64, 1e-4..1e-2f64),
            step_v in 0.1..2.0f64,
            (drift, way, wanted) in (0.0..0.5f64, 0.0..200.0f64, 0.0..100.0f64),
            down: bool,
        ) {
            let (within, in_a_tick) = (share + weight * relaxed, weight * relaxed);
            let braking = Braking::new(&Promptness { at_once: share, in_a_tick, relaxed }, step_v);
            let signal = |volts: f64| Signal::from_num(if down { -volts } else { volts });
            let outlook = Outlook { now: signal(0.0), then: signal(drift) };
            let found = braking.limit(signal(wanted), signal(drift + way), outlook).to_num::<f64>();

            let beyond = drift - within * step_v;
            let braked = in_a_tick * step_v + relaxed * (within * step_v + beyond / 2.0);
            let allowed = within / in_a_tick * ((2.0 * braked * way).sqrt() - beyond);
            let expected = if beyond > 0.0 { wanted.min(allowed) } else { wanted };
            let found = if down { -found } else { found };
            prop_assert!((found - expected).abs() < 0.01 + 0.01 * expected.abs(), "{found} {expected}");
        }

        #[test]
        fn a_root_is_rounded_down(square in 0u64..1 << 52, fewer in 0u32..52) {
            let square = square >> fewer;
            prop_assert_eq!(u64::from(root(square)), square.isqrt());
        }
    }
}
