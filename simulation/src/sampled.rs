//! The loop at the controller's rate in double precision, which the fixed-point tick must agree with.
//!
//! Written from the equations, independently of the `model` crate, from which it takes numbers only, and the design of a fall back, which is in
//! double precision there. Limits are clamped, and the [spring]'s step is exact for a voltage held between ticks.
//!
//! - Proportional-integral: a proportional and an integral part with back-calculation as anti-windup. A nonlinear spring is
//!   linearised around the last voltage with the steepest slope that it has anywhere.
//! - Time-optimal: the voltage that brings the spring to its target at the end of the tick, found by simulating copies of
//!   the spring over that tick.
//! - Robust: the same for the quickest spring that is possible, towards a target that is moved by a part of its lead over the spring, and
//!   lowered while the springs fall back.

pub mod spring;

use model::robust::FallBack;

pub use spring::{Spring, simulate};

/// Settings of the loop, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledLoop {
    /// Time between ticks, in s.
    pub sample_s: f64,
    /// The spring.
    pub spring: Spring,
    /// The controller.
    pub controller: Controller,
    /// Lowest and highest voltage, in V.
    pub range_v: (f64, f64),
    /// Slew limit, in V/s; infinite without one.
    pub slew_v_per_s: f64,
}

/// A controller and its parameters.
#[derive(Clone, Debug, PartialEq)]
pub enum Controller {
    /// The target is the voltage.
    None,
    /// Proportional gain (dimensionless) and integral gain (1/s).
    ProportionalIntegral(f64, f64),
    /// Time-optimal, with the time constant of its approach in s.
    TimeOptimal(f64),
    /// Robust, without a sensor.
    Robust(Robust),
}

/// The robust controller's parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Robust {
    /// The quickest spring that is possible, but for its gain.
    pub quick: Spring,
    /// Largest relative error of the gain.
    pub gain: f64,
    /// Overshoot that is allowed, as a part of the step.
    pub overshoot: f64,
    /// When the springs fall back, if they do.
    pub fall_back: Option<FallBack>,
}

/// State of spring, controller and amplifier, in V.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    spring: spring::State,
    integral: f64,
    voltage: f64,
    /// The robust controller's spring, its last target, and the step to it.
    quick: spring::State,
    target: f64,
    step: f64,
    phase: Phase,
    /// Half of the quick spring's lead when the target changed.
    lead_before: f64,
}

/// What a step has of its fall back.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Never,
    /// Largest lead in this step, as a part of it, since the quick spring was at the target.
    Before(f64),
    /// Number of ticks after which it ends.
    Back(u32),
    Over,
}

impl SampledLoop {
    /// The state at rest at 0 V.
    pub fn at_rest(&self) -> State {
        let quick = match &self.controller {
            Controller::Robust(robust) => robust.quick.at_rest(),
            _ => self.spring.at_rest(),
        };
        State {
            spring: self.spring.at_rest(),
            integral: 0.0,
            voltage: 0.0,
            quick,
            target: 0.0,
            step: 0.0,
            phase: Phase::Never,
            lead_before: 0.0,
        }
    }

    /// First half of a tick: returns the limited voltage before rounding, in V, for a target in V.
    pub fn drive(&self, state: &mut State, target: f64) -> f64 {
        let (lowest, highest) = self.range_v;
        let target = target.clamp(lowest, highest);
        let wanted = match &self.controller {
            Controller::None => target,
            Controller::TimeOptimal(approach_s) => {
                self.voltage_to_reach((&self.spring, &state.spring), target, *approach_s)
            }
            Controller::Robust(robust) => {
                let moved = target + self.excess(robust, state, target);
                self.voltage_to_reach((&robust.quick, &state.quick), moved, 0.0)
            }
            Controller::ProportionalIntegral(proportional, _) => {
                // u = Kp (target - y) + z with y = y0 + s (u - u0)
                let (before, steepest) = (state.spring.voltage(), self.spring.steepest_slope());
                let error = target - self.spring.stiffness(&state.spring) + steepest * before;
                (proportional * error + state.integral) / (1.0 + proportional * steepest)
            }
        };
        let step = self.slew_v_per_s * self.sample_s;
        let slewed = wanted.clamp(state.voltage - step, state.voltage + step);
        state.voltage = slewed.clamp(lowest, highest);
        if let Controller::ProportionalIntegral(proportional, integral_per_s) = &self.controller {
            let error = (wanted - state.integral) / proportional;
            let tracking_per_s = integral_per_s / proportional;
            state.integral += self.sample_s * (integral_per_s * error + tracking_per_s * (state.voltage - wanted));
        }
        state.voltage
    }

    /// How far above the target the quick spring is held: as far as the band of -3 % to the overshoot around it is used on both sides.
    fn excess(&self, robust: &Robust, state: &mut State, target: f64) -> f64 {
        let Robust { quick, gain, overshoot, fall_back } = robust;
        let stiffness = self.spring.stiffness(&state.spring);
        if target != state.target {
            (state.target, state.step, state.phase) = (target, target - stiffness, Phase::Before(0.0));
            state.lead_before = 0.5 * (quick.stiffness(&state.quick) - stiffness);
        }
        let most = f64::max(0.0, (1.0 + overshoot) / (1.0 + gain) - 1.0) * state.step;
        let reached = quick.stiffness(&state.quick);
        let lead = reached - stiffness;
        let held = |part: f64| (part * lead).clamp(most.min(0.0), most.max(0.0));
        let usual = 2.0 * overshoot / (overshoot + 0.03);
        let Some(fall_back) = fall_back else { return held(usual) };
        let lead_part = (lead - state.lead_before) / state.step;
        let settling_ticks = quick.settling_ticks(self.sample_s);
        state.phase = match state.phase {
            Phase::Before(largest) if (target - reached) / state.step <= 1.0 / 32.0 => {
                let largest = largest.max(lead_part);
                let jump = fall_back.jump * state.step;
                let slewed = FallBack::largest_jump_v(self.slew_v_per_s * self.sample_s, settling_ticks);
                let after = state.voltage + jump;
                let possible = jump.abs() <= slewed && after >= self.range_v.0 && after <= self.range_v.1;
                let ends = -state.lead_before / state.step <= fall_back.end.max(0.0);
                match lead_part < largest * (1.0 - 1.0 / 64.0) && lead_part <= fall_back.start {
                    true if possible && ends => Phase::Back(FallBack::longest_ticks(settling_ticks)),
                    true => Phase::Never,
                    false => Phase::Before(largest),
                }
            }
            Phase::Back(ticks) => Phase::Back(ticks.saturating_sub(1)),
            other => other,
        };
        if matches!(state.phase, Phase::Back(ticks) if ticks == 0 || lead_part <= fall_back.end) {
            state.phase = Phase::Over;
        }
        match state.phase {
            Phase::Back(_) => held(fall_back.part) - fall_back.depth * state.step,
            Phase::Over => held(fall_back.part),
            _ => held(usual),
        }
    }

    /// The voltage within the range that covers the approach's part of the distance to the target in the coming tick,
    /// found by regula falsi (Illinois), since the stiffness increases with the voltage.
    fn voltage_to_reach(&self, (spring, state): (&Spring, &spring::State), target: f64, approach_s: f64) -> f64 {
        let now = spring.stiffness(state);
        let part = if approach_s > 0.0 { -(-self.sample_s / approach_s).exp_m1() } else { 1.0 };
        let ahead = |volts: f64| {
            let mut tried = state.clone();
            spring.apply(&mut tried, volts);
            spring.hold(&mut tried, self.sample_s);
            spring.stiffness(&tried)
        };
        let reversal = spring.reversal(self.sample_s);
        let aim = self.limited_by_slew(reversal, now, ahead(state.voltage()), target, now + part * (target - now));
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

    /// Limits the `aim` for the end of the tick so that the slew limit leaves time to stop at the target; the stiffness
    /// is `now`, and `then` at the end of the tick under constant voltage. While the voltage turns back at the slew
    /// limit, every tick reduces the drift by the same amount and by the part that relaxes.
    fn limited_by_slew(&self, reversal: spring::Reversal, now: f64, then: f64, target: f64, aim: f64) -> f64 {
        let step = self.slew_v_per_s * self.sample_s;
        let (sign, drift) = ((then - now).signum(), (then - now).abs());
        let spring::Reversal { within_a_tick, in_each_later, relaxed } = reversal;
        let beyond = drift - within_a_tick * step;
        if beyond <= 0.0 || step.is_infinite() {
            return aim;
        }
        let slower = in_each_later * step + relaxed * (drift + within_a_tick * step) / 2.0;
        let allowed = (2.0 * slower * (sign * (target - then)).max(0.0)).sqrt();
        let limited = then + sign * within_a_tick / in_each_later * (allowed - beyond);
        if sign > 0.0 { aim.min(limited) } else { aim.max(limited) }
    }

    /// Second half of a tick: holds `applied` (V) across the spring; returns the stiffness just after it was applied,
    /// in V.
    pub fn apply(&self, state: &mut State, applied: f64) -> f64 {
        self.spring.apply(&mut state.spring, applied);
        let stiffness = self.spring.stiffness(&state.spring);
        self.spring.hold(&mut state.spring, self.sample_s);
        if let Controller::Robust(robust) = &self.controller {
            robust.quick.apply(&mut state.quick, applied);
            robust.quick.hold(&mut state.quick, self.sample_s);
        }
        stiffness
    }
}
