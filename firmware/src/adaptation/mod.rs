//! Adaptation after each control tick: parameters that the isolation bank has named are taken over by the running model
//! ([`model::adaptation`]).
//!
//! The control task watches in fixed point, and exchanges configurations at the end of a block. Between two blocks the housekeeping task
//! plans in floating point: [`Planner::plan`] gets what the first has shown, and what it builds is exchanged at the end of the next.
//! A block has 128 ticks; a plan that is later is dropped.
//!
//! Without the feature `adaptation` there are stand-ins of the same names without values.

#[cfg(not(feature = "adaptation"))]
mod disabled;
#[cfg(feature = "adaptation")]
mod enabled;
#[cfg(all(feature = "adaptation", any(feature = "mcu", test)))]
mod handover;
#[cfg(all(feature = "adaptation", feature = "mcu"))]
mod shared;
#[cfg(all(feature = "adaptation", test))]
mod tests;

#[cfg(not(feature = "adaptation"))]
pub use disabled::*;
#[cfg(feature = "adaptation")]
pub use enabled::*;
#[cfg(all(feature = "adaptation", feature = "mcu"))]
pub use shared::*;
