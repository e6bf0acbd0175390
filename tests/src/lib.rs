//! Helpers of the end-to-end tests, and the campaign that hides effects in records and asks for their names.

pub mod campaign;
pub mod defmt;
pub mod hidden;
pub mod vsj;
