//! `cargo xtask setup`: installs what a fresh machine lacks.
//!
//! In: the toolchain file and what rustup, the path and apt-get find installed. Out: an installed toolchain with its
//! components and targets, and QEMU. What is there already is left as it is.

mod apt;
mod toolchain;

use anyhow::{Context, Result};

use crate::shell;

/// The emulator's program.
const QEMU: &str = "qemu-system-arm";
/// Package of the emulator in Debian and Ubuntu.
const QEMU_PACKAGE: &str = "qemu-system-arm";

/// Installs the missing parts of the toolchain, then the emulator.
pub fn run() -> Result<()> {
    toolchain::install()?;
    emulator()
}

/// Installs QEMU with apt-get unless it starts.
pub fn emulator() -> Result<()> {
    if let Ok(version) = shell::command(QEMU).arg("--version").output() {
        let text = String::from_utf8_lossy(&version.stdout);
        eprintln!("setup: {} is installed", text.lines().next().unwrap_or(QEMU));
        return Ok(());
    }
    eprintln!("setup: {QEMU} is missing, installing it with apt-get");
    apt::install(QEMU_PACKAGE).with_context(|| format!("install {QEMU} by hand, then repeat this command"))
}
