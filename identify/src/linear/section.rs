//! One factor of the model's denominator, of first or second order, solved exactly between two times.
//!
//! ```text
//! first order:   T w' + w = u                          w
//! second order:  w'' / f^2 + 2 z w' / f + w = u        w  and  v = w' / f        f: angular frequency, z: damping ratio
//! ```
//!
//! A factor of second order has two real poles for `z >= 1` and a complex pair below; its response is smooth across `z = 1`, where
//! two separate lags would have the same response.

/// Smallest ratio of two time constants that are separate lags: closer ones would have large weights of opposite sign.
const DISTINCT: f64 = 1.25;

/// A factor of the denominator with a static gain of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Section {
    /// A lag.
    First {
        /// Time constant, in the unit of time of the series.
        tau: f64,
    },
    /// Two real poles or a complex pair.
    Second {
        /// Magnitude of the geometric mean of the poles, in radians per unit of time.
        frequency: f64,
        /// Damping ratio; at least 1 for two real poles.
        damping: f64,
    },
}

/// Exact transition over one interval: `x(t + h) = x_u(t + h) + phi (x(t) - x_u(t))` with the particular solution `x_u` under a
/// voltage that is linear in time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    /// First row of the transition matrix; the second is `(-phi[1], phi[2])`.
    phi: [f64; 3],
    /// Length of the interval.
    length: f64,
}

/// State of a section: `w` and `v`; `v` stays 0 in a lag.
pub(super) type State = [f64; 2];

impl Section {
    /// A factor of second order with the poles of two lags.
    pub fn of_lags(tau: f64, other: f64) -> Self {
        let frequency = 1.0 / (tau * other).sqrt();
        Self::Second { frequency, damping: 0.5 * (tau + other) * frequency }
    }

    /// Number of poles.
    pub fn order(self) -> usize {
        match self {
            Self::First { .. } => 1,
            Self::Second { .. } => 2,
        }
    }

    /// The time constants of real poles, largest first; `None` for a complex pair.
    pub fn time_constants(self) -> Option<Vec<f64>> {
        match self {
            Self::First { tau } => Some(vec![tau]),
            Self::Second { frequency, damping } if damping >= 1.0 => {
                let slow = (damping + (damping * damping - 1.0).sqrt()) / frequency;
                Some(vec![slow, 1.0 / (frequency * frequency * slow)])
            }
            Self::Second { .. } => None,
        }
    }

    /// The lags of a section with two distinct time constants, the slower one first, or the section itself.
    pub fn apart(self) -> Vec<Self> {
        match (self, self.time_constants().as_deref()) {
            (Self::Second { .. }, Some(&[slow, fast])) if slow > DISTINCT * fast => {
                vec![Self::First { tau: slow }, Self::First { tau: fast }]
            }
            _ => vec![self],
        }
    }

    /// The parameters that are searched: the natural logarithm of the time constant, or of frequency and damping ratio.
    pub(super) fn logarithms(self) -> impl Iterator<Item = f64> {
        let (values, count) = match self {
            Self::First { tau } => ([tau, 1.0], 1),
            Self::Second { frequency, damping } => ([frequency, damping], 2),
        };
        values.into_iter().take(count).map(f64::ln)
    }

    /// The section with its `which`-th parameter multiplied by `factor`.
    pub(super) fn times(self, which: usize, factor: f64) -> Self {
        match (self, which) {
            (Self::First { tau }, _) => Self::First { tau: tau * factor },
            (Self::Second { frequency, damping }, 0) => Self::Second { frequency: frequency * factor, damping },
            (Self::Second { frequency, damping }, _) => Self::Second { frequency, damping: damping * factor },
        }
    }

    /// The transition over an interval.
    pub(super) fn over(self, length: f64) -> Transition {
        let phi = match self {
            Self::First { tau } => [(-length / tau).exp(), 0.0, 0.0],
            Self::Second { frequency, damping } => {
                let angle = frequency * length;
                let (even, odd) = damped_pair(angle, damping);
                [even + damping * odd, odd, even - damping * odd]
            }
        };
        Transition { phi, length }
    }

    /// State at which the section moves with a voltage that has been linear for ever: value and slope.
    fn following(self, voltage: f64, slope: f64) -> State {
        match self {
            Self::First { tau } => [voltage - tau * slope, 0.0],
            Self::Second { frequency, damping } => [voltage - 2.0 * damping / frequency * slope, slope / frequency],
        }
    }

    /// The state at the end of an interval over which the voltage starts at `voltage` and has the given slope.
    #[inline]
    pub(super) fn step(self, over: &Transition, state: State, voltage: f64, slope: f64) -> State {
        let start = self.following(voltage, slope);
        let left = over.free([state[0] - start[0], state[1] - start[1]]);
        [start[0] + slope * over.length + left[0], start[1] + left[1]]
    }
}

impl Transition {
    /// The state at the end of an interval without a voltage.
    #[inline]
    pub(super) fn free(&self, [w, v]: State) -> State {
        let [ww, wv, vv] = self.phi;
        [ww * w + wv * v, vv * v - wv * w]
    }
}

/// Returns `exp(-z a) cos(q a)` and `exp(-z a) sin(q a) / q` with `q = sqrt(1 - z^2)`, continued through `z = 1`.
fn damped_pair(angle: f64, damping: f64) -> (f64, f64) {
    let square = (1.0 - damping) * (1.0 + damping);
    let turn = square.abs().sqrt() * angle;
    if turn < 1e-4 {
        let decay = (-damping * angle).exp();
        let sign = square.signum() * turn * turn;
        return (decay * (1.0 - sign / 2.0), decay * angle * (1.0 - sign / 6.0));
    }
    if square > 0.0 {
        let decay = (-damping * angle).exp();
        let (sin, cos) = turn.sin_cos();
        return (decay * cos, decay * sin * angle / turn);
    }
    let root = square.abs().sqrt();
    let (slow, fast) = ((-angle / (damping + root)).exp(), (-angle * (damping + root)).exp());
    (0.5 * (slow + fast), 0.5 * (slow - fast) / root)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reference is a Runge-Kutta integration with small steps.
    #[test]
    fn transition_solves_the_differential_equation() {
        for (frequency, damping) in [(3.0, 0.02), (0.7, 0.999_999_9), (0.7, 1.0), (2.0, 1.3), (0.1, 30.0)] {
            let section = Section::Second { frequency, damping };
            let slope_of = |[w, v]: State, u: f64| [frequency * v, frequency * (u - w - 2.0 * damping * v)];
            let (mut exact, length, parts) = ([0.3, -0.2], 1.7, 4000);
            exact = section.step(&section.over(length), exact, 2.0, -0.8);
            let (mut state, h) = ([0.3, -0.2], length / f64::from(parts));
            for part in 0..parts {
                let u = |of: f64| 2.0 - 0.8 * h * (f64::from(part) + of);
                let at = |state: State, k: State, of: f64| [state[0] + of * h * k[0], state[1] + of * h * k[1]];
                let k1 = slope_of(state, u(0.0));
                let k2 = slope_of(at(state, k1, 0.5), u(0.5));
                let k3 = slope_of(at(state, k2, 0.5), u(0.5));
                let k4 = slope_of(at(state, k3, 1.0), u(1.0));
                for i in 0..2 {
                    state[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
                }
            }
            assert!((0..2).all(|i| (state[i] - exact[i]).abs() < 1e-9), "{frequency} {damping}: {state:?} {exact:?}");
        }
    }

    #[test]
    fn time_constants_are_those_of_the_lags() {
        let section = Section::of_lags(2.0, 50.0);
        let taus = section.time_constants().unwrap();
        assert!((taus[0] - 50.0).abs() < 1e-9 && (taus[1] - 2.0).abs() < 1e-9, "{taus:?}");
        assert_eq!(Section::Second { frequency: 1.0, damping: 0.9 }.time_constants(), None);
    }
}
