//! Starts the package `emulation`, which verifies the firmware's images. It parses its arguments and prints its help
//! itself, so that `cargo xtask` compiles without the crates of the product.

use std::convert::Infallible;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::Command;

use anyhow::{Context, Result};

/// Arguments that are handed on as they are, `--help` included.
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub(crate) struct Forwarded {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _args: Vec<OsString>,
}

/// Compiles the emulation and replaces this process by it, in the caller's working directory, so that signals and the exit code are
/// the emulation's own. Returns on failure only.
pub(crate) fn replace(args: &[OsString]) -> Result<Infallible> {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(["run", "--quiet", "--package", "emulation", "--"]).args(args);
    eprintln!("$ cargo run --quiet --package emulation");
    Err(command.exec()).context("cannot start cargo")
}
