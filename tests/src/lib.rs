//! Helpers of the end-to-end tests: the program under test, a firmware image that only logs, and the properties that hold for
//! any bytes that come in.

pub mod defmt;
pub mod fuzz;
pub mod vsj;
