//! `cargo xtask setup`: installs what a fresh machine lacks.
//!
//! In: the toolchain file and what rustup, the path and apt-get find installed. Out: an installed toolchain with its
//! components and targets, and QEMU. What is there already is left as it is.

mod apt;
mod toolchain;

use std::path::PathBuf;

use anyhow::{Context, Result};

use crate::{python, shell};

/// The emulator: program and package in Debian and Ubuntu.
const QEMU: [&str; 2] = ["qemu-system-arm"; 2];
/// C for the MCU: GCC, without a C library.
const ARM_GCC: [&str; 2] = ["arm-none-eabi-gcc", "gcc-arm-none-eabi"];
/// C++ for this machine.
const CXX: [&str; 2] = ["c++", "g++"];
const CMAKE: [&str; 2] = ["cmake"; 2];
/// A browser for the tests of the page.
const CHROMIUM: [&str; 2] = ["chromium"; 2];

/// Installs the missing parts of the toolchain, then the emulator.
pub fn run() -> Result<()> {
    toolchain::install()?;
    emulator()
}

/// Has rustup add a target to the pinned toolchain unless it is there.
pub fn target(name: &str) -> Result<()> {
    toolchain::add_target(name)
}

/// Installs QEMU with apt-get unless it starts.
pub fn emulator() -> Result<()> {
    program(QEMU)
}

/// Installs GCC for the MCU with apt-get unless it starts.
pub fn arm_gcc() -> Result<()> {
    program(ARM_GCC)
}

/// Installs a C++ compiler with apt-get unless one starts.
pub fn cxx() -> Result<()> {
    program(CXX)
}

/// Installs CMake with apt-get unless it starts. Returns its program: that of the Python package's virtual environment if it is there.
pub fn cmake() -> Result<PathBuf> {
    let installed = python::folder(&shell::target_directory()?, "python").join("bin/cmake");
    if installed.exists() {
        return Ok(installed);
    }
    program(CMAKE)?;
    Ok(CMAKE[0].into())
}

/// Installs Chromium with apt-get unless it starts.
pub fn browser() -> Result<()> {
    program(CHROMIUM)
}

/// Installs the package of a program with apt-get unless the program starts.
fn program([name, package]: [&str; 2]) -> Result<()> {
    if let Ok(version) = shell::command(name).arg("--version").output() {
        let text = String::from_utf8_lossy(&version.stdout);
        eprintln!("setup: {} is installed", text.lines().next().unwrap_or(name));
        return Ok(());
    }
    eprintln!("setup: {name} is missing, installing it with apt-get");
    apt::install(package).with_context(|| format!("install {name} by hand, then repeat this command"))
}
