//! The faults of the tables, and their sizes.

use model::isolation;
use rand_chacha::ChaCha8Rng;

use crate::closed_loop::stair;
use crate::ground_truth::physics::{FULL_V, SHARE, TAU_S};
use crate::ground_truth::{Cause, Effect};

/// Sizes of the faults, as fractions of full size.
pub const SIZES: [f64; 4] = [1.0, 0.5, 0.25, 0.1];

/// What begins while the controller runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    None,
    /// An effect of the ground truth.
    Effect(Cause),
    /// The sensor repeats its last reading.
    Stuck,
}

impl Fault {
    /// Every fault: first those that the bank has signatures of, then those that it has not.
    pub fn all() -> Vec<Self> {
        let known = Cause::ALL.into_iter().map(Self::Effect).filter(|fault| fault.has_signature());
        let unknown = Cause::ALL.into_iter().map(Self::Effect).filter(|fault| !fault.has_signature());
        known.chain([Self::Stuck]).chain(unknown).collect()
    }

    /// The cause of the bank that this is; `None` if it has no signature of it.
    pub fn cause(self) -> Option<isolation::Cause> {
        isolation::Cause::named(self.name())
    }

    /// Size of its effect in the unit of the bank's cause ([`isolation::Cause::unit`]), for a bank of this range in V; `None` for a cause
    /// that has no other size than 1.
    pub fn size(self, effect: &Effect, range_v: f64) -> Option<f64> {
        match (self.cause()?, effect.values().as_slice()) {
            (isolation::Cause::GainError, &[gain]) => Some(gain - 1.0),
            (isolation::Cause::InstantaneousShare, &[share]) => Some(share - SHARE),
            (isolation::Cause::TimeConstant, &[tau_s]) => Some((tau_s / TAU_S).ln()),
            (isolation::Cause::VoltageDependentTimeConstant, &[low_s, high_s]) => {
                Some((high_s - low_s) / TAU_S * range_v / FULL_V)
            }
            (isolation::Cause::SecondRelaxation | isolation::Cause::ChargeLeakage, &[share, _]) => Some(share),
            // The quadratic law less the straight line with the same value at the end of the range.
            (isolation::Cause::StaticNonlinearity, &[bend]) => Some(-bend * range_v * range_v / (4.0 * FULL_V)),
            (isolation::Cause::AmplifierLimit, &[limit_v]) => Some(range_v - limit_v),
            (isolation::Cause::ReadingOffset, &[_, _, offset_v]) => Some(offset_v),
            (
                isolation::Cause::Drift
                | isolation::Cause::Hysteresis
                | isolation::Cause::Delay
                | isolation::Cause::AmplifierSlew
                | isolation::Cause::SeriesLag,
                &[size],
            ) => Some(size),
            _ => None,
        }
    }

    /// Cause code.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Effect(cause) => cause.name(),
            Self::Stuck => "stuck-sensor",
        }
    }

    /// True if the bank can name it.
    pub fn has_signature(self) -> bool {
        self.cause().is_some()
    }

    /// A random effect of this fault; at full size as the records of `cargo campaign` have it in the stair, a drift three times
    /// as fast, since the runs are shorter.
    pub fn effect(self, random: &mut ChaCha8Rng, size: f64) -> Option<Effect> {
        let Self::Effect(cause) = self else { return None };
        let mut effect = Effect::draw(random, cause, 0, &stair::schedule(), 1.0);
        match cause {
            Cause::Drift => effect.full_size[0] *= 3.0,
            // It begins with the fault and stays.
            Cause::ReadingOffset => {
                effect.full_size[..2].copy_from_slice(&[0.0, 1e9]);
                effect.neutral[..2].copy_from_slice(&[0.0, 1e9]);
            }
            _ => {}
        }
        Some(Effect { size, ..effect })
    }
}
