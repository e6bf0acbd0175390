//! The proportional-integral pre-compensator: shapes the voltage with deliberate overshoot, so that the stiffness
//! settles faster.
//!
//! Important terms:
//!
//! - *error*, `e`: target minus estimated stiffness, in V.
//! - *gains*: proportional `Kp` in V/V and integral `Ki` in 1/s ([`Gains`]).
//! - *integrator*, `z`: the state of the pre-compensator, in V.
//! - *operating point*: a voltage `v0` and the stiffness `y0` that it would give instantaneously ([`OperatingPoint`]).
//! - *anti-windup*: what keeps the integrator from running away while the amplifier limits the voltage.
//!
//! It closes a loop around the estimate, `u = Kp e + z`, `dz/dt = Ki e`, `e = target - y`, with two additions:
//!
//! - **No delay in the loop.** Part of the stiffness follows the voltage instantaneously, so `u` stands on both sides.
//!   With the operating point, `y = y0 + s (u - v0)` and `g = 1 / (1 + Kp s)`, the solution is
//!   `u = g z + (1 - g) v0 + g Kp (target - y0)`. For the plain spring `s` is its share, `v0 = y0` its relaxed part, and
//!   this is exact. An [extended](crate::extended) spring follows a curve of slope `s'`, 0 to `s`, that depends on
//!   voltage and direction; `s` is the largest slope, and the operating point is at the last voltage. One tick then
//!   brings `u` at least `g (1 + Kp s')` of the way to the curve's exact solution and never past it, so that the
//!   remaining distance shrinks in each tick to `Kp (s - s') / (1 + Kp s)` of itself: with the report's gain and share,
//!   to 0.27 at most. A tick needs no division.
//! - **Anti-windup by structure.** While nothing limits, `Kp e = u - z`, so `dz/dt = (u - z) Ki / Kp`: the integrator
//!   is a first-order lag, with the reset time `Kp / Ki`, of the voltage *that the amplifier really gave* after slew
//!   and range. While the amplifier limits, the integrator follows the output instead of running away, and it cannot
//!   leave the amplifier's range (Astrom and Haegglund's tracking form; Hanus's conditioning).
//!
//! Rounding to a DAC code is left out of that feedback: an integrator that tracked codes would stop short of the target
//! by up to a fraction of a code.

use crate::coefficient::{Gain, Rate, upper, widened};
use crate::error::OutOfRange;
use crate::estimator::{Model, OperatingPoint, StepGain};
use crate::units::{Accumulator, SampleTime, Signal, Volts, rarely, signal};
use crate::validated::Validated;

/// Proportional action, in V, beyond which any amplifier is at the end of its range.
const MAX_ACTION_V: f64 = 1024.0;

/// Gains of the proportional-integral pre-compensator, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Proportional gain `Kp`, in V of voltage per V of error, 0.001 to 100; the spring's dead-beat gain, which brings
    /// it to the target in one tick, is the upper bound where it is lower.
    pub proportional: f64,
    /// Integral gain `Ki`, in V of voltage per V of error and second, 0 to `proportional` / (10 sample times).
    pub integral_per_s: f64,
}

impl Gains {
    /// The gains that reproduce the source report's column "with controller"; the report does not print them.
    pub const PAPER: Self = Self { proportional: 4.0, integral_per_s: 1.35 };

    /// The gains of [`Gains::PAPER`], lowered as far as a quick spring demands.
    pub fn lowered_for(spring: &impl Model, sample_time: SampleTime) -> Self {
        let most = Self::most_proportional(&spring.largest_step_gain(sample_time));
        Self::with_proportional(Self::PAPER.proportional.min(most), sample_time)
    }

    /// A proportional gain with the integral gain of [`Gains::PAPER`], lowered as far as the sample time demands.
    pub fn with_proportional(proportional: f64, sample_time: SampleTime) -> Self {
        let integral_per_s = Self::PAPER.integral_per_s.min(Self::most_integral_per_s(proportional, sample_time));
        Self { proportional, integral_per_s }
    }

    /// The dead-beat gain of a spring of this largest step gain, at most 100 V/V.
    fn most_proportional(spring: &StepGain) -> f64 {
        // One tick moves the relaxed part by `relaxation + in_one_tick Kp g` of its distance; more than all of it
        // rings.
        let StepGain { feedthrough, in_one_tick, relaxation } = *spring;
        let ringing = in_one_tick - (1.0 - relaxation) * feedthrough;
        // A spring that cannot ring takes any gain.
        let dead_beat = (1.0 - relaxation) / ringing.max(f64::MIN_POSITIVE);
        dead_beat.min(100.0)
    }

    /// With a reset time of a few ticks the loop would hunt over DAC codes.
    fn most_integral_per_s(proportional: f64, sample_time: SampleTime) -> f64 {
        proportional / (10.0 * sample_time.seconds())
    }
}

/// The pre-compensator for one plant and sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProportionalIntegral {
    /// Kp g
    error_gain: Gain,
    /// Larger errors bring the voltage to the end of any range, too.
    largest_error: Signal,
    /// 1 - g
    operating_point_gain: Gain,
    /// g
    integrator_gain: Gain,
    /// T Ki / Kp
    reset: Rate,
}

/// The integrator's contribution to the voltage, `g z`, in V; the default is 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    integrator: Accumulator,
}

impl Gains {
    /// Checks the gains for a spring of this largest step gain.
    ///
    /// # Errors
    /// [`OutOfRange`] names `proportional_gain` or `integral_gain_per_s`.
    pub(crate) fn check(&self, spring: &StepGain, sample_time: SampleTime) -> Result<(), OutOfRange> {
        let most = Self::most_proportional(spring);
        OutOfRange::check("proportional_gain", self.proportional, 0.001..=most, "V/V")?;
        let fastest = Self::most_integral_per_s(self.proportional, sample_time);
        OutOfRange::check("integral_gain_per_s", self.integral_per_s, 0.0..=fastest, "1/s")
    }
}

impl Validated<'_, Gains> {
    /// Quantizes the gains, which were checked for a spring of this largest step gain.
    pub(crate) fn quantize(self, spring: &StepGain) -> ProportionalIntegral {
        let Gains { proportional, integral_per_s } = *self.settings();
        let g = 1.0 / (1.0 + proportional * spring.feedthrough);
        ProportionalIntegral {
            error_gain: Gain::new(proportional * g),
            largest_error: signal((MAX_ACTION_V / (proportional * g)).min(MAX_ACTION_V)),
            operating_point_gain: Gain::new(1.0 - g),
            integrator_gain: Gain::new(g),
            reset: Rate::new(self.sample_time().seconds() * integral_per_s / proportional),
        }
    }
}

impl ProportionalIntegral {
    /// Returns the voltage that this loop asks for, before the amplifier's limits.
    #[inline(always)]
    pub(crate) fn voltage(&self, state: &State, target: Volts, point: OperatingPoint) -> Volts {
        Volts(self.without_integrator(target, point).saturating_add(upper(state.integrator)))
    }

    /// Returns `(1 - g) v0 + g Kp (target - y0)`, in V.
    #[inline(always)]
    fn without_integrator(&self, target: Volts, point: OperatingPoint) -> Signal {
        let mut error = target.0 - point.stiffness;
        if error < -self.largest_error {
            error = rarely(-self.largest_error);
        }
        if error > self.largest_error {
            error = rarely(self.largest_error);
        }
        self.operating_point_gain.times(point.voltage) + self.error_gain.times(error)
    }

    /// Advances the integrator by one sample time with `driven` at the amplifier's input, after limits and before
    /// rounding.
    #[inline(always)]
    pub(crate) fn track(&self, state: &mut State, driven: Volts) {
        let lag = self.integrator_gain.times(driven.0).saturating_sub(upper(state.integrator));
        state.integrator += self.reset.step(lag);
    }

    /// Sets the integrator so that the next voltage for this `target` is the last one, `driven`.
    pub(crate) fn preset_integrator(&self, state: &mut State, driven: Volts, target: Volts, point: OperatingPoint) {
        state.integrator = widened(driven.0.saturating_sub(self.without_integrator(target, point)));
    }
}

#[cfg(test)]
mod tests;
