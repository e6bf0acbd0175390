//! The faults of the tables, and their sizes.

use rand_chacha::ChaCha8Rng;

use crate::closed_loop::stair;
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
        model::isolation::Cause::ALL.iter().any(|cause| cause.name() == self.name())
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
