//! A second-order low-pass filter, solved exactly for straight pieces of its input.

use crate::record::signal::lag::NO_SUBNORMAL;
use crate::record::signal::piecewise::{Piece, SAME_DURATION};

/// An underdamped second-order low-pass filter of unit gain, `x'' / w^2 + 2 zeta x' / w + x = u`, exact for straight pieces of the
/// input `u`.
#[derive(Clone, Copy, Debug)]
pub struct Oscillator {
    /// Angular frequency `w`, in 1/s.
    omega: f64,
    zeta: f64,
    /// Time by which the output follows a ramp, `2 zeta / w`, in s.
    behind_s: f64,
    x: f64,
    /// Rate of change of `x`, per s.
    rate: f64,
    /// State-transition matrices of the last duration, and of another one before: a delay divides every row into the same two
    /// pieces.
    transitions: [Transition; 2],
}

/// A state-transition matrix over a duration, in s.
#[derive(Clone, Copy, Debug)]
struct Transition {
    duration_s: f64,
    matrix: [[f64; 2]; 2],
}

impl Transition {
    /// The identity over no time.
    const NONE: Self = Self { duration_s: 0.0, matrix: [[1.0, 0.0], [0.0, 1.0]] };

    fn differs_from(&self, duration_s: f64) -> bool {
        (duration_s - self.duration_s).abs() > SAME_DURATION * duration_s
    }
}

impl Oscillator {
    /// Returns a filter with an angular frequency, in 1/s, and a damping ratio below 1, at an output `x` that changes by `rate`
    /// per second.
    pub fn at(omega: f64, zeta: f64, x: f64, rate: f64) -> Self {
        Self { omega, zeta, behind_s: 2.0 * zeta / omega, x, rate, transitions: [Transition::NONE; 2] }
    }

    /// Returns true if output and rate of change are 0.
    pub fn is_zero(&self) -> bool {
        self.x == 0.0 && self.rate == 0.0
    }

    /// Returns the present output.
    pub fn value(&self) -> f64 {
        self.x
    }

    /// Returns the present rate of change divided by the angular frequency, which has the unit of the output.
    pub fn scaled_rate(&self) -> f64 {
        self.rate / self.omega
    }

    /// Advances over one piece of the input and returns the output at its start and end.
    #[inline]
    pub fn pass(&mut self, Piece { duration_s, from, to }: Piece) -> (f64, f64) {
        let start = self.x;
        if duration_s > 0.0 {
            if self.transitions[0].differs_from(duration_s) {
                self.transitions.swap(0, 1);
                if self.transitions[0].differs_from(duration_s) {
                    let matrix = transition(self.omega, self.zeta, duration_s);
                    self.transitions[0] = Transition { duration_s, matrix };
                }
            }
            // The oscillation is around the straight line that the oscillator would settle on.
            let slope = if to == from { 0.0 } else { (to - from) / duration_s };
            let lag = self.behind_s * slope;
            let (dx, dv) = (self.x - (from - lag), self.rate - slope);
            let step = &self.transitions[0].matrix;
            self.x = to - lag + NO_SUBNORMAL + step[0][0] * dx + step[0][1] * dv;
            self.rate = slope + NO_SUBNORMAL + step[1][0] * dx + step[1][1] * dv;
        }
        (start, self.x)
    }

    /// Moves the output to where it would be if the input of the last piece, of `duration_s` s, had ended `more` higher.
    pub fn raise_end(&mut self, duration_s: f64, more: f64) {
        if duration_s > 0.0 {
            let slope = more / duration_s;
            let lag = self.behind_s * slope;
            let step = &self.transitions[0].matrix;
            self.x += more - lag + step[0][0] * lag - step[0][1] * slope;
            self.rate += slope + step[1][0] * lag - step[1][1] * slope;
        }
    }
}

/// Returns the state-transition matrix of the free oscillation over a time, in s, for displacement and velocity.
fn transition(omega: f64, zeta: f64, time_s: f64) -> [[f64; 2]; 2] {
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    let decay = (-zeta * omega * time_s).exp();
    let (sin, cos) = (damped * time_s).sin_cos();
    let s = sin / damped;
    [[decay * (cos + zeta * omega * s), decay * s], [-decay * omega * omega * s, decay * (cos - zeta * omega * s)]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compared with the textbook solution of a step, cut into two pieces.
    #[test]
    fn oscillator_is_exact_for_a_step() {
        let (omega, zeta, until_s) = (3.0f64, 0.2f64, 1.7);
        let mut filter = Oscillator::at(omega, zeta, 0.0, 0.0);
        for duration_s in [0.6, until_s - 0.6] {
            filter.pass(Piece { duration_s, from: 2.0, to: 2.0 });
        }
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let decay = (-zeta * omega * until_s).exp();
        let sine = (damped * until_s).sin();
        let exact = 2.0 * (1.0 - decay * ((damped * until_s).cos() + zeta * omega / damped * sine));
        let rate = 2.0 * decay * omega * omega / damped * sine;
        assert!((filter.x - exact).abs() < 1e-12 && (filter.scaled_rate() - rate / omega).abs() < 1e-12);
    }
}
