//! Every printed number of the source report that can be recomputed, compared with the computed one.
//!
//! In: `data/printed.toml` and the tables it names, where each printed number stands with its place, the name of the
//! computation that gives it, and that computation's inputs. Out: [`Report`], one [`Item`] a number, with an explanation
//! where printed and computed disagree. The code itself knows no number.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`source`], [`printed`] | the printed numbers; when a computed number agrees with the printed digits |
//! | [`compute`], [`models`], [`readings`] | the computations by name; those that run a model; those on measured numbers |
//! | `explain`, `slips`, `other_inputs` | general explanations of a disagreement: misprints, other inputs |
//! | [`report`] | all numbers computed, compared and explained |

mod comparison;
pub mod compute;
pub mod digits;
mod explain;
pub mod inputs;
pub mod models;
mod other_inputs;
pub mod outcome;
pub mod printed;
pub mod readings;
pub mod report;
mod slips;
pub mod source;

pub use report::{Item, Report, reproduce};
