//! The parts of `vsj` around the computation: what is printed and written, the firmware's log, the link to the MCU.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`output`] | terminal, CSV, plots, report page |
//! | [`log`] | the log that the firmware writes, decoded |
//! | [`mod@link`] | the host's side of the serial link to the MCU, the crate `link-host` |
//! | [`watch`] | the running loop on a full screen |
//! | [`qemu`] | the emulated board |
//! | [`signals`] | what Ctrl-C and other signals do |
// They panic on a closed pipe; `vsj` prints in its `output::terminal`.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

/// Version and git revision, which the firmware's boot message carries too.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("GIT_REVISION"), ")");

pub use link_host as link;
pub mod log;
pub mod output;
pub mod qemu;
pub mod signals;
pub mod watch;
