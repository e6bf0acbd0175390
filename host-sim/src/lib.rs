//! Runs the controller of the `model` crate on a host, beside references that are not it.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`schedule`], [`record`] | what voltage is asked for: the report's stair, or a file |
//! | [`csv_table`] | tables as CSV, read with clear errors |
//! | [`mod@reference`] | the loop in continuous time, solved exactly in double precision |
//! | [`sampled`] | the loop at the controller's own rate, in double precision |
//! | [`experiment`], [`judged`] | fixed point and reference side by side over a schedule |
//! | [`open_loop`] | the fixed-point spring alone over a record |
//! | [`response`], [`bound`] | t50, t90, t97, overshoot of each step, and the fastest any controller could be |
//! | [`stair`], [`comparison`] | what a run says, and what each controller makes of the same steps |
//! | [`tune`] | gains and settings for a spring, and what an error of its model costs |
//! | [`table3`], [`misprint`] | the report's table, and why a printed number is not reproduced |
//! | [`plant_file`] | the spring as a file |
//! | [`beam`], [`dynamics`], [`mod@joint`] | the report's models: leaf spring, how its stiffness changes, springs in a joint |
//! | [`mod@reproduce`] | every printed number of the report, computed again |
//! | [`log`] | the log that the firmware writes, decoded |
//! | [`mod@link`] | the serial link to the MCU |
//! | [`output`] | terminal, JSON, CSV, plots |

pub mod bad_input;
pub mod beam;
pub mod bound;
pub mod comparison;
pub mod csv_table;
pub mod diagnose;
pub mod dynamics;
pub mod experiment;
pub mod joint;
pub mod judged;
mod leap;
pub mod link;
pub mod log;
pub mod misprint;
pub mod open_loop;
pub mod output;
pub mod plant_file;
pub mod record;
pub mod reference;
pub mod reproduce;
pub mod response;
pub mod sampled;
pub mod schedule;
pub mod stair;
pub mod table3;
pub mod tune;

pub use bad_input::BadInput;
