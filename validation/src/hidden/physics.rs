//! The spring's laws, each with the forms that a cause may take.

/// The paper's spring: y = w + s (u - w), dw/dt = (u - w)/tau.
pub const SHARE: f64 = 1.0 / 11.0;
/// Its relaxation time in s.
pub const TAU_S: f64 = 5.5;
/// The voltage at which the sizes of static effects are stated, in V.
pub const FULL_V: f64 = 500.0;

/// Where the spring settles at a voltage that stays, in V. All laws settle at 0 at 0 V, and at 500 V at 500 V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// f(u) = u.
    Straight,
    /// Sensitivity grows linearly from 1 - bend to 1 + bend: f(u) = u + bend u (u - U)/U.
    Quadratic(f64),
    /// f(u) = U (exp(2 bend u/U) - 1)/(exp(2 bend) - 1): to first order as far from straight at 250 V.
    Exponential(f64),
    /// f(u) = u (1 + c)/(1 + c u/U) with c = |bend|: as far again, to the other side.
    Saturating(f64),
}

impl Law {
    /// The settled stiffness at `u`, in V.
    pub fn at(self, u: f64) -> f64 {
        let part = u / FULL_V;
        match self {
            Self::Straight => u,
            Self::Quadratic(bend) => u + bend * u * (part - 1.0),
            Self::Exponential(bend) if bend.abs() < 1e-9 => u,
            Self::Exponential(bend) => FULL_V * (2.0 * bend * part).exp_m1() / (2.0 * bend).exp_m1(),
            Self::Saturating(bend) => u * (1.0 + bend.abs()) / (1.0 + bend.abs() * part),
        }
    }
}

/// Relaxation time over the voltage, in s.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the variants' docs say it")]
pub enum Tau {
    /// A straight line through `low_s` at 0 V and `high_s` at 500 V, which beyond ends at half of the shorter one: on its way
    /// to 1000 V it might become negative, which is no spring.
    Linear { low_s: f64, high_s: f64 },
    /// low_s (high_s/low_s)^(u/500 V).
    Exponential { low_s: f64, high_s: f64 },
}

impl Tau {
    /// At `u`, in s.
    pub fn at(self, u: f64) -> f64 {
        match self {
            Self::Linear { low_s, high_s } => (low_s + (high_s - low_s) * u / FULL_V).max(low_s.min(high_s) / 2.0),
            Self::Exponential { low_s, high_s } => low_s * (high_s / low_s).powf(u / FULL_V),
        }
    }
}

/// Part of the response with a slower time constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Creep {
    /// Of the settled response.
    pub share: f64,
    /// Slower time constant in s.
    pub tau_s: f64,
    /// True: taken from the immediate part as well, y = (1 - c) y_paper + c w2. False: from the relaxing part alone.
    pub from_everything: bool,
}

/// Part of the response that is lost while the voltage stays: y - share L.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leakage {
    /// Of the settled response.
    pub share: f64,
    /// In s.
    pub tau_s: f64,
    /// False: L follows the relaxed response, dL/dt = (y - L)/tau. True: it follows the charge before it has relaxed.
    pub before: bool,
}

/// How the response goes with time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drift {
    /// y (1 + d t).
    Multiplicative(f64),
    /// y exp(d t).
    Exponential(f64),
    /// y + d t 500 V.
    Additive(f64),
}

impl Drift {
    /// The response `y` after `t` s.
    pub fn of(self, y: f64, t: f64) -> f64 {
        match self {
            Self::Multiplicative(per_s) => y * (1.0 + per_s * t),
            Self::Exponential(per_s) => y * (per_s * t).exp(),
            Self::Additive(per_s) => y + per_s * t * FULL_V,
        }
    }
}

/// A mode that is underdamped: p'' = omega^2 (q - p) - 2 zeta omega p', where q is what excites it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resonance {
    /// Undamped, in Hz.
    pub freq_hz: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// How much of the response takes part: y + participation (p - q).
    pub participation: f64,
    /// True: the immediate part of the response alone excites it. False: all of it.
    pub immediate: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_constant_stays_positive_at_any_voltage() {
        for (low_s, high_s) in [(9.9, 3.0), (3.0, 9.9)] {
            for u in [0.0, 250.0, 500.0, 700.0, 1000.0] {
                assert!(Tau::Linear { low_s, high_s }.at(u) >= 1.5, "{low_s} {high_s} {u}");
                assert!(Tau::Exponential { low_s, high_s }.at(u) > 0.9, "{low_s} {high_s} {u}");
            }
        }
    }

    #[test]
    fn laws_meet_at_both_ends_and_bend_as_stated_between() {
        for law in [Law::Quadratic(0.2), Law::Exponential(0.2), Law::Saturating(0.2)] {
            assert!(law.at(0.0).abs() < 1e-9 && (law.at(FULL_V) - FULL_V).abs() < 1e-9, "{law:?}");
            let off = (law.at(250.0) - 250.0).abs();
            assert!((15.0..30.0).contains(&off), "{law:?}: {off}");
        }
        assert!((Law::Quadratic(0.2).at(250.0) - 225.0).abs() < 1e-9);
    }
}
