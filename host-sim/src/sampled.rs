//! The loop at the controller's own rate in double precision: the textbook PI that the fixed-point tick must agree with.
//!
//! Written from the equations, not from the `model` crate, of which it takes numbers only: a proportional and an integral
//! part, back-calculation as anti-windup, limits by clamping, and the [spring]'s exact step for a voltage held between
//! ticks. Where the spring's answer to a voltage is a curve, the controller takes it for straight, from the last voltage
//! on and as steep as it is anywhere.

pub mod spring;

pub use spring::Spring;

/// Settings in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledLoop {
    /// Time between ticks, in s.
    pub sample_s: f64,
    /// The spring.
    pub spring: Spring,
    /// Proportional and integral gain (1/s) of the controller; `None` puts the target out as it is.
    pub gains: Option<(f64, f64)>,
    /// Lowest and highest voltage, in V.
    pub range_v: (f64, f64),
    /// Fastest change, in V/s; infinite where there is no limit.
    pub slew_v_per_s: f64,
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
        let wanted = match self.gains {
            None => target,
            Some((proportional, _)) => {
                // u = Kp (target - y) + z with y = y0 + s (u - u0)
                let (before, steepest) = (state.spring.voltage(), self.spring.steepest());
                let error = target - self.spring.stiffness(&state.spring) + steepest * before;
                (proportional * error + state.integral) / (1.0 + proportional * steepest)
            }
        };
        let step = self.slew_v_per_s * self.sample_s;
        let slewed = wanted.clamp(state.voltage - step, state.voltage + step);
        state.voltage = slewed.clamp(lowest, highest);
        if let Some((proportional, integral_per_s)) = self.gains {
            let error = (wanted - state.integral) / proportional;
            let tracking_per_s = integral_per_s / proportional;
            state.integral += self.sample_s * (integral_per_s * error + tracking_per_s * (state.voltage - wanted));
        }
        state.voltage
    }

    /// Second half: `applied` volts are put across the spring and held; returns the stiffness just after, in V.
    pub fn apply(&self, state: &mut State, applied: f64) -> f64 {
        self.spring.apply(&mut state.spring, applied);
        let stiffness = self.spring.stiffness(&state.spring);
        self.spring.hold(&mut state.spring, self.sample_s);
        stiffness
    }
}

/// The spring alone: its stiffness in V at increasing times in s, just after each of the voltages in V was put across it,
/// each held until the next time.
pub fn simulate(spring: &Spring, time_s: &[f64], voltage_v: &[f64]) -> Vec<f64> {
    let mut state = spring.at_rest();
    let lasts = time_s.windows(2).map(|pair| pair[1] - pair[0]).chain([0.0]);
    let points = voltage_v.iter().zip(lasts);
    let at = |(&voltage, lasts): (&f64, f64)| {
        spring.apply(&mut state, voltage);
        let stiffness = spring.stiffness(&state);
        spring.hold(&mut state, lasts);
        stiffness
    };
    points.map(at).collect()
}
