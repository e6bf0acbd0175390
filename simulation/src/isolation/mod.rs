//! The bank of [`model::isolation`] on a host: over a record, and its reference in double precision.

pub mod readings;
pub mod reference;
pub mod trace;
