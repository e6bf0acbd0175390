//! Limits of decisions of the search and of the verdict, in one place so that a command can vary them. Limits of a single check, algorithm
//! sizes and numerical tolerances stay with their code.
//!
//! - [`probability`]: limits that follow from the probability of a false alarm.
//! - [`empirical`]: limits that were set by counting right and wrong diagnoses. `cargo thresholds` counts again at half and twice
//!   each value; with the feature `sensitivity` a process can change one of them.

pub mod empirical;
pub mod probability;
mod threshold;

pub use threshold::Threshold;
#[cfg(feature = "sensitivity")]
pub use threshold::vary;
