//! The spring of the tests that has every block.

use model::extended::{ExtendedPlant, Law, Leakage, Memory, Relaxation};

/// Everything at once, on the scale of a real spring. The plays come in no order.
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
