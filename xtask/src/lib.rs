//! Parts that the binary `xtask` and the package `emulation` share.
//!
//! In: which controller, amplifier and board. Out: built images of the firmware, started programs with errors that name
//! them, installed tools. No crate of the product is a dependency, so that `cargo xtask` compiles in seconds.

pub mod build;
pub mod documents;
pub mod files;
pub mod python;
mod seal;
pub mod segments;
pub mod setup;
pub mod shell;
pub mod tally;
pub mod tool;
pub mod variant;
