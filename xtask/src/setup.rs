//! What a fresh machine lacks.

use std::fs;
use std::io;
use std::process::Command;

use anyhow::{Context, Result};

use crate::{emulator, shell};

/// The pinned toolchain and what goes with it; the only list of it.
const TOOLCHAIN_FILE: &str = "rust-toolchain.toml";

/// Package of the emulator, Debian and Ubuntu.
const QEMU_PACKAGE: &str = "qemu-system-arm";

/// `cargo xtask setup`.
pub(crate) fn run() -> Result<()> {
    toolchain()?;
    emulator()
}

/// QEMU, from the distribution.
pub(crate) fn emulator() -> Result<()> {
    if let Ok(version) = shell::command(emulator::QEMU).arg("--version").output() {
        let text = String::from_utf8_lossy(&version.stdout);
        eprintln!("setup: {} is there", text.lines().next().unwrap_or(emulator::QEMU));
        return Ok(());
    }
    eprintln!("setup: {} is missing, installing it with apt-get", emulator::QEMU);
    let help = || format!("install {} by hand, then repeat this command", emulator::QEMU);
    apt_get(&["update"]).with_context(help)?;
    apt_get(&["install", "--yes", "--no-install-recommends", QEMU_PACKAGE]).with_context(help)
}

/// As root, or through sudo.
fn apt_get(args: &[&str]) -> Result<()> {
    let is_root = shell::output(shell::command("id").arg("-u"))?.trim() == "0";
    let mut command = if is_root { shell::command("apt-get") } else { shell::command("sudo") };
    if !is_root {
        command.args(["--non-interactive", "apt-get"]);
    }
    shell::run(command.args(args).env("DEBIAN_FRONTEND", "noninteractive"))
}

fn toolchain() -> Result<()> {
    let path = shell::root().join(TOOLCHAIN_FILE);
    let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let (channel, parts) = wanted(&text).with_context(|| format!("cannot use {TOOLCHAIN_FILE}"))?;

    let missing = missing(&channel, &parts)
        .context("rustup does not start: install it from https://rustup.rs, then repeat this command")?;
    if missing.is_empty() {
        eprintln!("setup: Rust {channel} with {} is there, nothing to do", parts.join(", "));
        return Ok(());
    }
    eprintln!("setup: missing for Rust {channel}: {}", missing.join(", "));
    // Without a name rustup takes the file, and with it components and targets. It must not update itself meanwhile.
    shell::run(rustup().args(["toolchain", "install", "--no-self-update"]))
}

/// Channel and parts of a toolchain file, the parts under the names that rustup's list uses.
fn wanted(text: &str) -> Result<(String, Vec<String>)> {
    let file: toml::Table = text.parse()?;
    let toolchain = file.get("toolchain").context("no [toolchain]")?;
    let channel = toolchain.get("channel").and_then(|c| c.as_str()).context("no channel")?;
    let names = |key| {
        let list = toolchain.get(key).and_then(|l| l.as_array());
        list.into_iter().flatten().filter_map(|name| name.as_str())
    };
    let parts = names("components").map(String::from).chain(names("targets").map(|t| format!("rust-std-{t}")));
    Ok((channel.into(), parts.collect()))
}

/// The parts that are not installed; all of them if the toolchain itself is not.
fn missing(channel: &str, parts: &[String]) -> io::Result<Vec<String>> {
    let list = rustup().args(["component", "list", "--installed", "--toolchain", channel]).output()?;
    if !list.status.success() {
        return Ok([String::from("the toolchain")].into_iter().chain(parts.iter().cloned()).collect());
    }
    let installed = String::from_utf8_lossy(&list.stdout);
    // A component's line ends with the host's triple, as in `clippy-x86_64-unknown-linux-gnu`.
    let is_there = |part: &&String| installed.lines().any(|line| line.starts_with(part.as_str()));
    Ok(parts.iter().filter(|part| !is_there(part)).cloned().collect())
}

/// Inside `cargo xtask` this variable names a toolchain, and rustup would overlook the file.
fn rustup() -> Command {
    let mut command = shell::command("rustup");
    command.env_remove("RUSTUP_TOOLCHAIN");
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_projects_own_file_is_understood() {
        let (channel, parts) = wanted(include_str!("../../rust-toolchain.toml")).unwrap();
        assert!(channel.contains('.'), "{channel} is not one release");
        assert!(parts.contains(&format!("rust-std-{}", shell::MCU)), "{parts:?}");
    }
}
