//! The source report computed again: its models, its stair experiment and every number it prints.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`table3`], [`misprint`] | the report's Table 3, and the likeliest reason why a printed number is not reproduced |
//! | [`stair`] | a run of the stair experiment compared with Table 3 |
//! | [`beam`], [`dynamics`], [`mod@joint`] | the report's models: leaf spring, how its stiffness changes, springs in a joint |
//! | [`mod@reproduce`] | every printed number of the report, computed again |
//! | [`figure`] | curves and points over common axes, to be drawn |
// They panic on a closed pipe; `vsj` prints in its `output::terminal`.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod beam;
pub mod dynamics;
pub mod figure;
pub mod joint;
pub mod misprint;
pub mod reproduce;
pub mod stair;
pub mod table3;
