//! A spring with every block, for several tests.

use model::extended::{ExtendedPlant, Law, Leakage, Memory, Relaxation};

/// All blocks, on the scale of a real spring. The plays are not sorted by threshold.
pub(crate) const WHOLE: ExtendedPlant<'_> = ExtendedPlant {
    memory: Some(Memory { direct: 0.8, thresholds_v: &[25.0, 10.0], weights: &[0.05, 0.15] }),
    law: Some(Law { voltage_v: &[0.0, 100.0, 300.0, 500.0], stiffness: &[0.0, 80.0, 300.0, 500.0] }),
    leakage: Some(Leakage { share: 0.1, time_constant_s: 40.0 }),
    relaxation: Relaxation {
        share: 0.0909,
        time_constants_s: &[5.5, 40.0],
        weights: &[0.8, 0.109],
        time_constant_high_s: Some(8.0),
    },
};
