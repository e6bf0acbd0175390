//! Laws of the spring, each with the forms that a cause may have.

/// Instantaneous share s of the paper's spring, y = w + s (u - w), dw/dt = (u - w)/tau.
pub const SHARE: f64 = 1.0 / 11.0;
/// Relaxation time tau of the paper's spring, in s.
pub const TAU_S: f64 = 5.5;
/// Voltage U at which the sizes of static effects are stated, in V.
pub const FULL_V: f64 = 500.0;

/// Settled stiffness f(u) at a constant voltage u, both in V. All laws have f(0) = 0 and f(U) = U at U = 500 V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// No nonlinearity: f(u) = u.
    Straight,
    /// Sensitivity linear from 1 - bend at 0 V to 1 + bend at U: f(u) = u + bend u (u - U)/U.
    Quadratic(f64),
    /// f(u) = U (exp(2 bend u/U) - 1)/(exp(2 bend) - 1): to first order the same deviation at 250 V as `Quadratic`.
    Exponential(f64),
    /// f(u) = u (1 + c)/(1 + c u/U) with c = |bend|: to first order the same deviation at 250 V, always upward.
    Saturating(f64),
}

impl Law {
    /// Settled stiffness at the voltage `u`, both in V.
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

/// Relaxation time as a function of the voltage, in s.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the variants' docs say it")]
pub enum Tau {
    /// Linear from `low_s` at 0 V to `high_s` at 500 V and beyond, but at least half of the shorter one, so that it
    /// stays positive up to 1000 V.
    Linear { low_s: f64, high_s: f64 },
    /// Geometric: low_s (high_s/low_s)^(u/500 V).
    Exponential { low_s: f64, high_s: f64 },
}

impl Tau {
    /// Relaxation time at the voltage `u` in V, in s.
    pub fn at(self, u: f64) -> f64 {
        match self {
            Self::Linear { low_s, high_s } => (low_s + (high_s - low_s) * u / FULL_V).max(low_s.min(high_s) / 2.0),
            Self::Exponential { low_s, high_s } => low_s * (high_s / low_s).powf(u / FULL_V),
        }
    }
}

/// A further lag of the nominal spring: its part of the relaxing response, whose rest has the main time constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Further {
    /// Part of the relaxing response, 0 to 1.
    pub part: f64,
    /// Time constant, in s.
    pub tau_s: f64,
}

impl Default for Further {
    fn default() -> Self {
        Self { part: 0.0, tau_s: TAU_S }
    }
}

/// Second relaxation (creep): part of the response has a slower time constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Creep {
    /// Share c of the settled response.
    pub share: f64,
    /// Slower time constant, in s.
    pub tau_s: f64,
    /// True: the share is taken from the whole response, y = (1 - c) y_paper + c w2. False: from the relaxing part
    /// only.
    pub from_everything: bool,
}

/// Charge leakage: part of the response is lost at a constant voltage, y - share L.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leakage {
    /// Share of the settled response that is lost.
    pub share: f64,
    /// Time constant of the leakage, in s.
    pub tau_s: f64,
    /// False: L follows the relaxed response, dL/dt = (y - L)/tau. True: L follows the settled response v.
    pub before: bool,
}

/// Change of the response y with the time t, at a rate d in 1/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drift {
    /// Linear factor: y (1 + d t).
    Multiplicative(f64),
    /// Exponential factor: y exp(d t).
    Exponential(f64),
    /// Linear term: y + d t 500 V.
    Additive(f64),
}

impl Drift {
    /// Response `y`, in V, with the drift after `t` s.
    pub fn of(self, y: f64, t: f64) -> f64 {
        match self {
            Self::Multiplicative(per_s) => y * (1.0 + per_s * t),
            Self::Exponential(per_s) => y * (per_s * t).exp(),
            Self::Additive(per_s) => y + per_s * t * FULL_V,
        }
    }
}

/// Underdamped mode p with the excitation q: p'' = omega^2 (q - p) - 2 zeta omega p'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resonance {
    /// Undamped natural frequency, in Hz.
    pub freq_hz: f64,
    /// Damping ratio, dimensionless.
    pub zeta: f64,
    /// Participation factor: the response is y + participation (p - q).
    pub participation: f64,
    /// True: q is the instantaneous part of the response. False: q is the whole response.
    pub immediate: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_constants_stay_positive_up_to_1000_v() {
        for (low_s, high_s) in [(9.9, 3.0), (3.0, 9.9)] {
            for u in [0.0, 250.0, 500.0, 700.0, 1000.0] {
                assert!(Tau::Linear { low_s, high_s }.at(u) >= 1.5, "{low_s} {high_s} {u}");
                assert!(Tau::Exponential { low_s, high_s }.at(u) > 0.9, "{low_s} {high_s} {u}");
            }
        }
    }

    #[test]
    fn laws_are_exact_at_both_ends_and_bend_as_stated_between() {
        for law in [Law::Quadratic(0.2), Law::Exponential(0.2), Law::Saturating(0.2)] {
            assert!(law.at(0.0).abs() < 1e-9 && (law.at(FULL_V) - FULL_V).abs() < 1e-9, "{law:?}");
            let off = (law.at(250.0) - 250.0).abs();
            assert!((15.0..30.0).contains(&off), "{law:?}: {off}");
        }
        assert!((Law::Quadratic(0.2).at(250.0) - 225.0).abs() < 1e-9);
    }
}
