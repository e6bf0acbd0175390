//! Validation of the diagnosis and of the controller by simulated records and springs with known effects.
//!
//! In: seeds and sizes of the test sets. Out: tables and acceptance criteria, as Markdown and as data to serialise.
//!
//! | module | contents |
//! | --- | --- |
//! | [`ground_truth`] | simulators of springs with known effects; they share no code with `identify` |
//! | [`criterion`], [`markdown`] | one acceptance criterion; Markdown tables |
//! | [`statistics`] | normal and sample quantiles, an interval of a frequency, sums |
//! | [`campaign`] | counts the causes that the diagnosis names in many records |
//! | [`isolation`] | the fault isolation in the tick, on springs in which a fault begins |
//! | [`closed_loop`] | the controller in closed loop with a spring with known effects, with a stiffness sensor and without |

pub mod campaign;
pub mod closed_loop;
pub mod criterion;
pub use ground_truth;
pub mod isolation;
pub mod markdown;
pub mod statistics;
