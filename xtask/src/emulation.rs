//! Starts the package `emulation`, which verifies the firmware's images. It parses its arguments and prints its help
//! itself, so that `cargo xtask` compiles without the crates of the product.

use std::convert::Infallible;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use anyhow::{Context, Result, bail};

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

/// Runs command lines of the emulation, each with a name for `begin`, two at a time, since each of them needs one core. What one
/// prints is printed when it ends. An exit code other than 0 is an error, after which no other is begun.
pub(crate) fn run_all(lines: &[(&str, &[&str])], begin: impl Fn(&str) + Sync) -> Result<()> {
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let printing = Mutex::new(());
    let work = || -> Result<()> {
        while let Some((name, args)) = lines.get(next.fetch_add(1, Ordering::Relaxed))
            && !failed.load(Ordering::Relaxed)
        {
            begin(name);
            let output = command().args(*args).output().context("cannot start cargo")?;
            let turn = printing.lock();
            eprint!("{}", String::from_utf8_lossy(&output.stderr));
            eprint!("{}", String::from_utf8_lossy(&output.stdout));
            drop(turn);
            if !output.status.success() {
                failed.store(true, Ordering::Relaxed);
                bail!("`cargo xtask {}` failed ({})", args.join(" "), output.status);
            }
        }
        Ok(())
    };
    thread::scope(|scope| {
        let other = scope.spawn(work);
        let own = work();
        own.and(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}

/// Replaces this process by the emulation, so that signals and the exit code are the emulation's own. Returns on
/// failure only.
pub(crate) fn replace(args: &[OsString]) -> Result<Infallible> {
    Err(command().args(args).exec()).context("cannot start cargo")
}
