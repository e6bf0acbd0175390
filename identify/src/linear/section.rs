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

/// Sections that are solved together: each waits for its own last state, so that a processor solves several in the time of one.
pub(super) const TOGETHER: usize = 4;

/// A number of each of these sections.
pub(super) type Each = [f64; TOGETHER];

/// States of the sections: `w` and `v`; `v` stays 0 in a lag.
pub(super) type States = [Each; 2];

/// Exact transition over one interval: `x(t + h) = x_u(t + h) + phi (x(t) - x_u(t))` with the particular solution `x_u` under a
/// voltage that is linear in time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    /// First row of the transition matrix; the second is `(-phi[1], phi[2])`.
    phi: [Each; 3],
    /// Length of the interval.
    length: f64,
}

/// How sections move with a voltage that has been linear for ever.
#[derive(Clone, Copy, Debug)]
pub(super) struct Following {
    /// Time by which `w` lags behind the voltage.
    lag: Each,
    /// Ratio of the voltage's slope and `v`; infinite for a lag, which has no `v`.
    frequency: Each,
}

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

    /// First row of the transition matrix over an interval.
    fn phi(self, length: f64) -> [f64; 3] {
        match self {
            Self::First { tau } => [(-length / tau).exp(), 0.0, 0.0],
            Self::Second { frequency, damping } => {
                let angle = frequency * length;
                let (even, odd) = damped_pair(angle, damping);
                [even + damping * odd, odd, even - damping * odd]
            }
        }
    }
}

impl Following {
    /// How each of these sections moves.
    pub(super) fn of(sections: &[Section; TOGETHER]) -> Self {
        let lag = sections.map(|section| match section {
            Section::First { tau } => tau,
            Section::Second { frequency, damping } => 2.0 * damping / frequency,
        });
        let frequency = sections.map(|section| match section {
            Section::First { .. } => f64::INFINITY,
            Section::Second { frequency, .. } => frequency,
        });
        Self { lag, frequency }
    }

    /// The states at the end of an interval over which the voltage starts at `voltage` and has the given slope.
    #[inline]
    pub(super) fn step(&self, over: &Transition, [w, v]: States, voltage: f64, slope: f64) -> States {
        let (mut follows, mut left) = ([[0.0; TOGETHER]; 2], [[0.0; TOGETHER]; 2]);
        for of in 0..TOGETHER {
            follows[0][of] = voltage - self.lag[of] * slope;
            follows[1][of] = slope / self.frequency[of];
            left[0][of] = w[of] - follows[0][of];
            left[1][of] = v[of] - follows[1][of];
        }
        left = over.free(left);
        let change = slope * over.length;
        for of in 0..TOGETHER {
            left[0][of] += follows[0][of] + change;
            left[1][of] += follows[1][of];
        }
        left
    }
}

impl Transition {
    /// The transition of each section over an interval.
    pub(super) fn of(sections: &[Section; TOGETHER], length: f64) -> Self {
        let each = sections.map(|section| section.phi(length));
        Self { phi: std::array::from_fn(|entry| each.map(|phi| phi[entry])), length }
    }

    /// The states at the end of an interval without a voltage.
    #[inline]
    pub(super) fn free(&self, [w, v]: States) -> States {
        let [ww, wv, vv] = &self.phi;
        let mut states = [[0.0; TOGETHER]; 2];
        for of in 0..TOGETHER {
            states[0][of] = ww[of] * w[of] + wv[of] * v[of];
            states[1][of] = vv[of] * v[of] - wv[of] * w[of];
        }
        states
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
            let slope_of = |[w, v]: [f64; 2], u: f64| [frequency * v, frequency * (u - w - 2.0 * damping * v)];
            let (mut exact, length, parts) = ([0.3, -0.2], 1.7, 4000);
            let together = [section; TOGETHER];
            let over = Transition::of(&together, length);
            let end = Following::of(&together).step(&over, exact.map(|of| [of; TOGETHER]), 2.0, -0.8);
            exact = end.map(|each| each[TOGETHER - 1]);
            let (mut state, h) = ([0.3, -0.2], length / f64::from(parts));
            for part in 0..parts {
                let u = |of: f64| 2.0 - 0.8 * h * (f64::from(part) + of);
                let at = |state: [f64; 2], k: [f64; 2], of: f64| [state[0] + of * h * k[0], state[1] + of * h * k[1]];
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
