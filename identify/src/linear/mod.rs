//! The best linear models of a record: readings and voltage come in; models of order 0 to 4 with their held-out errors go out.
//!
//! ```text
//! reading(t) = zero + d u(t - delay) + sum of numerators / denominators applied to u(t - delay) + free response
//! ```
//!
//! - *Order*: number of poles; a model of order 0 is a gain and a zero.
//! - *Section*: a factor of the denominator, of first or second order, with static gain 1.
//! - *Free response*: what remains at the first reading of earlier voltages, decaying with the poles.
//! - *Output error*: the model runs from the voltage alone and never sees a reading; all errors are of this kind.
//!
//! All units are the record's own; every constant is relative to the rows' spacing, the record's length or the error itself.

mod columns;
pub mod held_out;
mod path;
pub mod problem;
pub mod search;
pub mod section;
pub mod series;

pub use held_out::held_out_residual;
pub use problem::{Fit, Poles, Problem, SAME_PLACE};
pub use search::{LARGEST_ORDER, best_of_each_order, best_up_to, fewest_readings};
pub use section::Section;
pub use series::Series;

#[cfg(test)]
mod tests;
