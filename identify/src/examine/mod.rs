//! The diagnosis of a record from beginning to end.
//!
//! In comes a record with [`Options`], out comes a [`Diagnosis`](crate::verdict::diagnosis::Diagnosis). [`passes`] holds the
//! passes over the record, in the order in which they run.

mod options;
pub mod passes;

pub use options::Options;
pub use passes::{diagnose, examine};
