//! Runs the fixed-point loop of the `model` crate over a schedule on a host and compares it with references in double
//! precision.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`schedule`], [`record`] | the commanded voltage over time: the report's stair, or a file |
//! | [`units`] | units in which a user reads times, voltages and readings |
//! | [`csv_table`], [`mod@bad_input`] | CSV tables, and errors that name what was expected |
//! | [`option_names`] | the options that set the fields which errors name |
//! | [`bounded_file`] | other files, up to a bound on their size |
//! | [`plant_file`], [`settings_file`] | the spring and the settings of an MCU as a file |
//! | [`mod@reference`] | the loop in continuous time, solved exactly in double precision |
//! | [`sampled`] | the loop at the controller's own rate, in double precision |
//! | [`run`], [`has_reference`], [`experiment`] | fixed point and reference over a schedule |
//! | [`open_loop`] | the fixed-point spring alone over a record |
//! | [`control_loop`] | controller and spring of a plant file, one tick at a time |
//! | [`isolation`] | the bank of fault signatures over a record, and its reference |
//! | [`response`], [`bound`] | t50, t90, t97, overshoot of each step, and the shortest possible t97 |
//! | [`spring_error`] | the tick on a spring that differs from its model, with a sensor or without |
//! | [`robust_bound`] | the shortest possible t97 for a spring that is known only to within errors |
//! | [`comparison`], [`tune`] | controllers compared on the same steps; gains for a spring and the cost of a model error |
// They panic on a closed pipe; `vsj` prints in its `output::terminal`.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod adaptation;
pub mod bad_input;
pub mod bound;
pub mod bounded_file;
pub mod comparison;
pub mod control_loop;
pub mod csv_table;
pub mod experiment;
pub mod has_reference;
pub mod isolation;
pub mod open_loop;
pub mod option_names;
pub mod plant_file;
pub mod record;
pub mod reference;
pub mod response;
#[cfg(not(target_family = "wasm"))]
pub mod robust_bound;
pub mod run;
pub mod sampled;
pub mod schedule;
pub mod settings_file;
pub mod spring_error;
#[cfg(not(target_family = "wasm"))]
pub mod tune;
pub mod units;

pub use bad_input::BadInput;
