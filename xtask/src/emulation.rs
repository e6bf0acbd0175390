//! Starts the package `emulation`, which verifies the firmware's images. It parses its arguments and prints its help
//! itself, so that `cargo xtask` compiles without the crates of the product.

use std::convert::Infallible;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::Command;

use anyhow::{Context, Result, ensure};

/// Arguments that are handed on as they are, `--help` included.
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub(crate) struct Forwarded {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _args: Vec<OsString>,
}

/// The command that compiles and starts the emulation, in the caller's working directory.
fn command() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(["run", "--quiet", "--package", "emulation", "--"]);
    command
}

/// Runs a command line of the emulation to its end. An exit code other than 0 is an error.
pub(crate) fn run(args: &[&str]) -> Result<()> {
    let status = command().args(args).status().context("cannot start cargo")?;
    ensure!(status.success(), "`cargo xtask {}` failed ({status})", args.join(" "));
    Ok(())
}

/// Replaces this process by the emulation, so that signals and the exit code are the emulation's own. Returns on
/// failure only.
pub(crate) fn replace(args: &[OsString]) -> Result<Infallible> {
    Err(command().args(args).exec()).context("cannot start cargo")
}
