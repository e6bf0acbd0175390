//! Helpers of the end-to-end tests, the campaign that hides effects in records and asks for their names, and the loop that
//! a controller closes around a spring with a hidden effect.

pub mod campaign;
pub mod closed_loop;
pub mod hidden;
