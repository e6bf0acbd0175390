//! Helpers of the end-to-end tests: the program under test, and a firmware image that only logs.

pub mod defmt;
pub mod vsj;
