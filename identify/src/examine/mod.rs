//! The diagnosis of a record from beginning to end.
//!
//! In comes a record with [`Options`], out comes a [`Diagnosis`](crate::verdict::diagnosis::Diagnosis). [`passes`] holds the
//! passes over the record, in the order in which they run, `merits` decides between two nominal springs, `several` diagnoses several
//! records of one spring.

mod hypothesis;
mod merits;
mod options;
pub mod passes;
mod several;

pub use options::Options;
pub use passes::{diagnose, examine};
pub use several::examine_several;
