//! The loop at the controller's own rate in double precision: what the fixed-point tick must agree with.
//!
//! Written from the equations, not from the `model` crate, of which it takes numbers only: limits by clamping, and the
//! [spring]'s exact step for a voltage held between ticks.
//!
//! - The textbook PI: a proportional and an integral part, back-calculation as anti-windup. Where the spring's answer to a
//!   voltage is a curve, the controller takes it for straight, from the last voltage on and as steep as it is anywhere.
//! - Time-optimal: the voltage that brings the spring to its target by the end of the tick, found by running copies of the
//!   spring through that tick.

pub mod spring;

pub use spring::{Spring, simulate};

/// Settings in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledLoop {
    /// Time between ticks, in s.
    pub sample_s: f64,
    /// The spring.
    pub spring: Spring,
    /// How the voltage is led to the target.
    pub controller: Controller,
    /// Lowest and highest voltage, in V.
    pub range_v: (f64, f64),
    /// Fastest change, in V/s; infinite where there is no limit.
    pub slew_v_per_s: f64,
}

/// The controllers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Controller {
    /// Puts the target out as it is.
    None,
    /// Proportional and integral gain (1/s).
    ProportionalIntegral(f64, f64),
    /// Time constant of the approach, in s.
    TimeOptimal(f64),
}

/// State of the spring, the controller and the amplifier, all in V.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    spring: spring::State,
    integral: f64,
    voltage: f64,
}

impl SampledLoop {
    /// Without voltage, settled.
    pub fn at_rest(&self) -> State {
        State { spring: self.spring.at_rest(), integral: 0.0, voltage: 0.0 }
    }

    /// First half of a tick: the limited voltage before rounding, in V.
    pub fn drive(&self, state: &mut State, target: f64) -> f64 {
        let (lowest, highest) = self.range_v;
        let target = target.clamp(lowest, highest);
        let wanted = match self.controller {
            Controller::None => target,
            Controller::TimeOptimal(approach_s) => self.leading_to(&state.spring, target, approach_s),
            Controller::ProportionalIntegral(proportional, _) => {
                // u = Kp (target - y) + z with y = y0 + s (u - u0)
                let (before, steepest) = (state.spring.voltage(), self.spring.steepest());
                let error = target - self.spring.stiffness(&state.spring) + steepest * before;
                (proportional * error + state.integral) / (1.0 + proportional * steepest)
            }
        };
        let step = self.slew_v_per_s * self.sample_s;
        let slewed = wanted.clamp(state.voltage - step, state.voltage + step);
        state.voltage = slewed.clamp(lowest, highest);
        if let Controller::ProportionalIntegral(proportional, integral_per_s) = self.controller {
            let error = (wanted - state.integral) / proportional;
            let tracking_per_s = integral_per_s / proportional;
            state.integral += self.sample_s * (integral_per_s * error + tracking_per_s * (state.voltage - wanted));
        }
        state.voltage
    }

    /// The voltage, within the range, that makes up as much of the way to the target in the coming tick as the approach
    /// says; by regula falsi (Illinois), since more voltage always gives more stiffness.
    fn leading_to(&self, spring: &spring::State, target: f64, approach_s: f64) -> f64 {
        let now = self.spring.stiffness(spring);
        let part = if approach_s > 0.0 { -(-self.sample_s / approach_s).exp_m1() } else { 1.0 };
        let ahead = |volts: f64| {
            let mut tried = spring.clone();
            self.spring.apply(&mut tried, volts);
            self.spring.hold(&mut tried, self.sample_s);
            self.spring.stiffness(&tried)
        };
        let aim = self.braked(now, ahead(spring.voltage()), target, now + part * (target - now));
        let missed = |volts: f64| ahead(volts) - aim;
        let (mut low, mut high) = self.range_v;
        let (mut at_low, mut at_high) = (missed(low), missed(high));
        if at_low >= 0.0 || at_high <= 0.0 {
            return if at_low >= 0.0 { low } else { high };
        }
        let mut side = 0;
        for _ in 0..100 {
            let middle = high - at_high * (high - low) / (at_high - at_low);
            let at_middle = missed(middle);
            if at_middle.abs() < 1e-12 || high - low < 1e-9 {
                return middle;
            }
            if at_middle > 0.0 {
                (high, at_high) = (middle, at_middle);
                if side == 1 {
                    at_low *= 0.5;
                }
                side = 1;
            } else {
                (low, at_low) = (middle, at_middle);
                if side == -1 {
                    at_high *= 0.5;
                }
                side = -1;
            }
        }
        0.5 * (low + high)
    }

    /// What of an aim for the end of the tick leaves the slew time to stop at the target; the stiffness is `now`, and
    /// `then` at the end of the tick if the voltage stays. While the voltage turns back at the slew, each tick takes the
    /// same from the drift, and the relaxation its part.
    fn braked(&self, now: f64, then: f64, target: f64, aim: f64) -> f64 {
        let step = self.slew_v_per_s * self.sample_s;
        let (sign, drift) = ((then - now).signum(), (then - now).abs());
        let spring::Turning { within_a_tick, in_each_later, relaxed } = self.spring.turning(self.sample_s);
        let beyond = drift - within_a_tick * step;
        if beyond <= 0.0 || step.is_infinite() {
            return aim;
        }
        let slower = in_each_later * step + relaxed * (drift + within_a_tick * step) / 2.0;
        let allowed = (2.0 * slower * (sign * (target - then)).max(0.0)).sqrt();
        let braked = then + sign * within_a_tick / in_each_later * (allowed - beyond);
        if sign > 0.0 { aim.min(braked) } else { aim.max(braked) }
    }

    /// Second half: `applied` volts are put across the spring and held; returns the stiffness just after, in V.
    pub fn apply(&self, state: &mut State, applied: f64) -> f64 {
        self.spring.apply(&mut state.spring, applied);
        let stiffness = self.spring.stiffness(&state.spring);
        self.spring.hold(&mut state.spring, self.sample_s);
        stiffness
    }
}
