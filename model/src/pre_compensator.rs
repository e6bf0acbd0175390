//! The proportional-integral pre-compensator: drives the voltage past the target and back.
//!
//! It closes a loop around the estimate, `u = Kp e + z`, `dz/dt = Ki e`, `e = target - y`. Two things make it more than
//! that line:
//!
//! - **No delay in the loop.** Part of the stiffness follows the voltage at once, so `u` stands on both sides. The
//!   estimator gives a [`Pivot`], a voltage `v0` and the stiffness `y0` that it would give at once; with
//!   `y = y0 + s (u - v0)` and `g = 1 / (1 + Kp s)`, solved: `u = g z + (1 - g) v0 + g Kp (target - y0)`.
//!   For the plain spring `s` is its share, `v0 = y0` its relaxed part, and this is exact. An
//!   [extended](crate::extended) spring answers with a curve of slope `s'`, 0 to `s`, that depends on voltage and
//!   direction; `s` is the steepest, and the pivot the last voltage. One tick then brings `u` at least
//!   `g (1 + Kp s')` of the way to the curve's exact solution and never past it, so that what is left shrinks in each
//!   tick by `Kp (s - s') / (1 + Kp s)`: with the report's gain and share, 0.27 at the most. No division in a tick.
//! - **Anti-windup by structure.** While nothing limits, `Kp e = u - z`, so `dz/dt = (u - z) Ki / Kp`: the integrator is
//!   a first-order lag, with the reset time `Kp / Ki`, of the voltage *that the amplifier really gave* after slew and
//!   range. Limited, it follows the output instead of running away, and it cannot leave the amplifier's range
//!   (Astrom and Haegglund's tracking form; Hanus's conditioning).
//!
//! Rounding to a DAC code is left out of that feedback: an integrator that tracked codes would stop short of the target
//! by up to a fraction of a code.

use crate::coefficient::{Gain, Rate, upper};
use crate::error::OutOfRange;
use crate::estimator::{Pivot, Promptness};
use crate::units::{Accumulator, SampleTime, Signal, Volts, signal};

/// Volts of proportional action beyond which any range is at its end, so that no more need be computed.
const ENOUGH_V: f64 = 1024.0;

/// Gains in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Volts per volt of error, 0.001 to 100, and no more than what brings the spring to its target in one tick.
    pub proportional: f64,
    /// Volts per volt of error and second, 0 to `proportional` / ten sample times.
    pub integral_per_s: f64,
}

impl Gains {
    /// The gains that reproduce the report's column "with controller"; it does not print them.
    pub const PAPER: Self = Self { proportional: 4.0, integral_per_s: 1.35 };
}

/// The pre-compensator for one plant and sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProportionalIntegral {
    /// Kp g
    error_gain: Gain,
    /// Errors beyond +-this drive the voltage to an end of any range all the same.
    largest_error: Signal,
    /// 1 - g
    pivot_gain: Gain,
    /// g
    integrator_gain: Gain,
    /// T Ki / Kp
    reset: Rate,
}

/// The integrator as it enters the voltage, g z, in volts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    integrator: Accumulator,
}

impl Gains {
    /// For a spring that is as prompt as this.
    ///
    /// # Errors
    /// [`OutOfRange`] names `proportional_gain` or `integral_gain_per_s`.
    pub(crate) fn check(&self, spring: &Promptness, sample_time: SampleTime) -> Result<(), OutOfRange> {
        // One tick moves what has relaxed by `relaxed + in_a_tick Kp g` of its distance; more than all of it rings.
        let Promptness { at_once, in_a_tick, relaxed } = *spring;
        let ringing = in_a_tick - (1.0 - relaxed) * at_once;
        let deadbeat = if ringing > 0.0 { (1.0 - relaxed) / ringing } else { f64::INFINITY };
        OutOfRange::check("proportional_gain", self.proportional, 0.001..=deadbeat.min(100.0), "V/V")?;
        // A reset within a few ticks makes the loop hunt over DAC codes.
        let fastest = self.proportional / (10.0 * sample_time.seconds());
        OutOfRange::check("integral_gain_per_s", self.integral_per_s, 0.0..=fastest, "1/s")
    }
}

impl ProportionalIntegral {
    /// Of gains that [`Gains::check`] accepts for this spring.
    pub(crate) fn new(gains: &Gains, spring: &Promptness, sample_time: SampleTime) -> Self {
        let Gains { proportional, integral_per_s } = *gains;
        let g = 1.0 / (1.0 + proportional * spring.at_once);
        Self {
            error_gain: Gain::new(proportional * g),
            largest_error: signal((ENOUGH_V / (proportional * g)).min(ENOUGH_V)),
            pivot_gain: Gain::new(1.0 - g),
            integrator_gain: Gain::new(g),
            reset: Rate::new(sample_time.seconds() * integral_per_s / proportional),
        }
    }

    /// The voltage that this loop asks for, before the amplifier's limits.
    #[inline(always)]
    pub(crate) fn voltage(&self, state: &State, target: Volts, pivot: Pivot) -> Volts {
        Volts(upper(state.integrator).saturating_add(self.without_integrator(target, pivot)))
    }

    /// `(1 - g) v0 + g Kp (target - y0)`
    #[inline(always)]
    fn without_integrator(&self, target: Volts, pivot: Pivot) -> Signal {
        let error = (target.0 - pivot.stiffness).max(-self.largest_error).min(self.largest_error);
        self.pivot_gain.times(pivot.voltage) + self.error_gain.times(error)
    }

    /// One sample time passes with `driven` at the amplifier's input, after limits and before rounding.
    #[inline(always)]
    pub(crate) fn track(&self, state: &mut State, driven: Volts) {
        let lag = self.integrator_gain.times(driven.0).saturating_sub(upper(state.integrator));
        state.integrator += self.reset.step(lag);
    }

    /// Sets the integrator so that, at this `target`, the loop asks for the `driven` voltage again.
    pub(crate) fn align(&self, state: &mut State, driven: Volts, target: Volts, pivot: Pivot) {
        let integrator = driven.0.saturating_sub(self.without_integrator(target, pivot));
        state.integrator = Accumulator::from_bits(i64::from(integrator.to_bits()) << 32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::{Model, Plant};

    #[test]
    fn wrong_gains_are_named() {
        let time = SampleTime::from_rate(1000.0).unwrap();
        let named = |proportional, integral_per_s| {
            let gains = Gains { proportional, integral_per_s };
            gains.check(&Plant::PAPER.promptness(time), time).unwrap_err().field
        };
        assert_eq!(named(-4.0, 1.35), "proportional_gain");
        assert_eq!(named(0.0, 1.35), "proportional_gain");
        assert_eq!(named(f64::NAN, 1.35), "proportional_gain");
        assert_eq!(named(4.0, -1.35), "integral_gain_per_s");
        assert_eq!(named(4.0, f64::NAN), "integral_gain_per_s");
        // A reset faster than ten ticks is not sampled well.
        assert_eq!(named(4.0, 401.0), "integral_gain_per_s");
        // The spring would be past its target after one tick, back after two, and so on.
        let slow = SampleTime::from_rate(100.0).unwrap();
        let quick = Plant { share: 0.0, time_constant_s: 0.1 }.promptness(slow);
        let error = Gains { proportional: 20.0, integral_per_s: 1.0 }.check(&quick, slow);
        assert_eq!(error.unwrap_err().field, "proportional_gain");
    }
}
