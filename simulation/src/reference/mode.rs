//! The modes of the loop: what determines the voltage, and the solution within a mode.

use crate::reference::Solution;

/// What determines the voltage for some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mode {
    /// The control law; no limit acts.
    Free,
    /// The voltage is linear in time: constant at an end of the range, or at the slew limit, until the control law
    /// takes over.
    Straight { slope: f64 },
}

/// Tolerance within which a voltage counts as being at a limit, in V.
const TOLERANCE_V: f64 = 1e-9;

impl Solution {
    /// Slope of the control law's voltage, in V/s, while it is followed.
    fn law_slope(&self, slope: f64) -> f64 {
        let (dw, dz) = ((self.u - self.w) / self.system.time_constant_s, (self.u - self.z) * self.reset_per_s);
        self.law[0] * dw + self.law[1] * dz + self.law[2] * slope
    }

    /// Mode from now on; moves `u` where it can follow immediately.
    pub(super) fn mode(&mut self, target: f64, slope: f64) -> Mode {
        self.jump(target);
        let (lowest, highest) = self.system.range_v;
        let ahead = self.law_at(self.w, self.z, target) - self.u;
        let slew = self.system.slew_v_per_s;
        // Direction in which the control law would move the voltage, by its value or, if that is reached, by its slope.
        let pull = if ahead.abs() > TOLERANCE_V { ahead } else { self.law_slope(slope) };
        let at_end = if pull > 0.0 { self.u >= highest - TOLERANCE_V } else { self.u <= lowest + TOLERANCE_V };
        if at_end && pull != 0.0 {
            Mode::Straight { slope: 0.0 }
        } else if ahead.abs() > TOLERANCE_V || pull.abs() > slew {
            Mode::Straight { slope: slew.copysign(pull) }
        } else {
            Mode::Free
        }
    }

    /// The solution after `duration_s` seconds in one mode.
    pub(super) fn after(&self, mode: Mode, target: f64, slope: f64, duration_s: f64) -> Self {
        let mut next = self.clone();
        match mode {
            Mode::Free => {
                let other;
                let transition = if duration_s == self.sample_s {
                    &self.whole
                } else {
                    other = self.transition(duration_s);
                    &other
                };
                [next.w, next.z] = self.moved(transition, target, slope);
                next.u = self.law_at(next.w, next.z, target + slope * duration_s);
            }
            Mode::Straight { slope } => {
                next.w = follow(self.w, self.u, slope, 1.0 / self.system.time_constant_s, duration_s);
                next.z = follow(self.z, self.u, slope, self.reset_per_s, duration_s);
                next.u = self.u + slope * duration_s;
            }
        }
        next
    }

    /// True if this solution violates the conditions of `mode`.
    pub(super) fn broken(&self, mode: Mode, target: f64, slope: f64) -> bool {
        let (lowest, highest) = self.system.range_v;
        let ahead = self.law_at(self.w, self.z, target) - self.u;
        let outside = self.u > highest + TOLERANCE_V || self.u < lowest - TOLERANCE_V;
        match mode {
            Mode::Free => outside || self.law_slope(slope).abs() > self.system.slew_v_per_s * (1.0 + 1e-9),
            Mode::Straight { slope } if slope != 0.0 => outside || ahead * slope < 0.0,
            // At an end of the range, until the control law points back inside.
            Mode::Straight { .. } => {
                let end = if self.u > 0.5 * (lowest + highest) { 1.0 } else { -1.0 };
                ahead * end < -TOLERANCE_V
            }
        }
    }
}

/// First-order lag with `rate` (1/s) whose input starts at `u` (V) with a `slope` (V/s), after `duration_s` seconds.
fn follow(state: f64, u: f64, slope: f64, rate: f64, duration_s: f64) -> f64 {
    if rate == 0.0 {
        return state;
    }
    let behind = slope / rate;
    u + slope * duration_s - behind + (state - u + behind) * (-rate * duration_s).exp()
}
