//! Helpers of the end-to-end tests.

pub mod defmt;
pub mod vsj;
