//! Colours that have the same meaning in all plots.

/// Colour of the readings.
pub(super) const READING: &str = "#000000";
/// Colour of the original simulation.
pub(super) const BEFORE: &str = "#d55e00";
/// Colour of the extended simulation.
pub(super) const AFTER: &str = "#0072b2";
/// Colour of the commanded voltage.
pub(super) const COMMAND: &str = "#888888";
