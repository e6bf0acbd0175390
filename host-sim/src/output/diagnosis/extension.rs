//! Whether a diagnosis has extended the simulation.

use identify::Diagnosis;

/// True if the extended simulation differs from the original one: causes were added or parts taken out.
pub(super) fn is_extended(diagnosis: &Diagnosis) -> bool {
    !diagnosis.extended.model.blocks.is_empty() || !diagnosis.report.take_out.is_empty()
}
