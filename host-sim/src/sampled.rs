//! The loop at the controller's own rate in double precision: the textbook PI that the fixed-point tick must agree with.
//!
//! Written from the equations, not from the `model` crate: a proportional and an integral part, back-calculation as
//! anti-windup, limits by clamping, and the spring's exact step for a voltage held between ticks.

/// Settings in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledLoop {
    /// Time between ticks, in s.
    pub sample_s: f64,
    /// Instantaneous share of a change, 0 to 1.
    pub share: f64,
    /// Time constant of the rest, in s.
    pub time_constant_s: f64,
    /// Proportional gain.
    pub proportional: f64,
    /// Integral gain, in 1/s.
    pub integral_per_s: f64,
    /// Lowest and highest voltage, in V.
    pub range_v: (f64, f64),
    /// Fastest change, in V/s; infinite where there is no limit.
    pub slew_v_per_s: f64,
}

/// State of the spring, the controller and the amplifier, all in V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    relaxed: f64,
    integral: f64,
    voltage: f64,
}

impl SampledLoop {
    /// First half of a tick: the limited voltage before rounding, in V.
    pub fn drive(&self, state: &mut State, target: f64) -> f64 {
        let (lowest, highest) = self.range_v;
        let target = target.clamp(lowest, highest);
        // u = Kp (target - y) + z with y = share u + (1 - share) w
        let wanted = (self.proportional * (target - (1.0 - self.share) * state.relaxed) + state.integral)
            / (1.0 + self.proportional * self.share);
        let step = self.slew_v_per_s * self.sample_s;
        let slewed = wanted.clamp(state.voltage - step, state.voltage + step);
        state.voltage = slewed.clamp(lowest, highest);
        let error = (wanted - state.integral) / self.proportional;
        let tracking_per_s = self.integral_per_s / self.proportional;
        state.integral += self.sample_s * (self.integral_per_s * error + tracking_per_s * (state.voltage - wanted));
        state.voltage
    }

    /// Second half: `applied` volts are put across the spring and held; returns the stiffness just after, in V.
    pub fn apply(&self, state: &mut State, applied: f64) -> f64 {
        let stiffness = self.share * applied + (1.0 - self.share) * state.relaxed;
        let kept = (-self.sample_s / self.time_constant_s).exp();
        state.relaxed = applied + (state.relaxed - applied) * kept;
        stiffness
    }
}
