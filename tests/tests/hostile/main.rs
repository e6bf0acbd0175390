//! Hostile input to the command line: damaged, absurd and endless files, absurd arguments, full disks and signals.
//!
//! Each module is one class of input, as a table. Whatever comes in, `vsj` ends with 0, 1 or 2 within a minute of processor
//! time and 2 GiB of address space, says in one line what is wrong, never panics, writes all its results or none, and leaves
//! no temporary file.
//!
//! `cargo test --release -p end-to-end --test hostile -- --nocapture` prints how many runs each class has.
#![cfg(target_os = "linux")]

mod arguments;
mod attack;
mod elf;
mod numbers;
mod outputs;
mod plants;
mod records;
mod tables;
