//! The fixed-point spring and controller as co-simulation units (FMUs) of FMI 2.0 and 3.0.
//!
//! This crate is built twice: as a library of `vsj export fmu`, which writes the units, and as the shared library inside of them,
//! which any program that imports FMUs loads. One shared library serves every unit: it reads from the unit's `resources` which
//! spring and which settings it has.
//!
//! | module | content |
//! | --- | --- |
//! | [`mod@unit`] | a kind of unit, its spring and its settings, and their files in `resources` |
//! | [`variable`], [`variables`] | a variable; the variables of a unit: names, units, ranges, start values |
//! | [`description`], `parts` | `modelDescription.xml` for both versions |
//! | `machine` | values of the variables in, ticks, values out |
//! | `instance` | one instance: what may be called when, time, messages, saved states |
//! | `status` | the status of a call, and the category of its message |
//! | `ffi` | pointers of the C interface |
//! | `fmi2`, `fmi3` | the functions that an importer calls |
//! | `uri` | folders as URIs |
//!
//! Errors have the text of the command's errors.

pub mod description;
mod ffi;
mod fmi2;
mod fmi3;
mod instance;
mod machine;
mod parts;
mod status;
pub mod unit;
mod uri;
pub mod variable;
pub mod variables;
mod version;

pub use unit::{Kind, Unit};
pub use version::Version;
