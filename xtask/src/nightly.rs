//! The nightly toolchain: sanitizers, Miri and libFuzzer need options that the stable compiler does not have.

use std::ffi::OsStr;
use std::process::Command;

use anyhow::{Context, Result};
use xtask::shell;

/// Name of the toolchain in rustup.
const TOOLCHAIN: &str = "nightly";

/// The nightly cargo, with the root of the workspace as its working directory.
pub(crate) fn cargo() -> Command {
    command("cargo")
}

/// A program that calls the nightly cargo. The toolchain and the flags of the cargo that started `cargo xtask` are not
/// inherited.
pub(crate) fn command(program: impl AsRef<OsStr>) -> Command {
    let mut command = shell::command("rustup");
    command.args(["run", TOOLCHAIN]).arg(program);
    for variable in ["RUSTUP_TOOLCHAIN", "CARGO", "RUSTC", "RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS"] {
        command.env_remove(variable);
    }
    command
}

/// Installs the nightly toolchain and one of its components, unless both are there.
///
/// # Errors
/// If rustup is missing, or cannot download them.
pub(crate) fn install(component: &str) -> Result<()> {
    let list = ["component", "list", "--installed", "--toolchain", TOOLCHAIN];
    // A toolchain that is missing is an error of rustup's, whose text would only confuse.
    let installed =
        shell::command("rustup").args(list).output().context("rustup does not start; see https://rustup.rs")?;
    if has(&String::from_utf8_lossy(&installed.stdout), component) {
        return Ok(());
    }
    eprintln!("{component} of the toolchain {TOOLCHAIN} is missing, installing it");
    let install = ["toolchain", "install", TOOLCHAIN, "--profile", "minimal", "--no-self-update", "--component"];
    shell::run(shell::command("rustup").args(install).arg(component))
        .with_context(|| format!("{component} of the toolchain {TOOLCHAIN} is needed, and rustup cannot install it"))
}

/// Whether the list of installed components contains `component`, alone or with a target's name.
fn has(list: &str, component: &str) -> bool {
    list.lines()
        .any(|line| line.strip_prefix(component).is_some_and(|target| target.is_empty() || target.starts_with('-')))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_component_is_found_by_its_whole_name() {
        let list = "cargo-x86_64-unknown-linux-gnu\nmiri-x86_64-unknown-linux-gnu\nrust-src\n";
        assert!(has(list, "miri") && has(list, "rust-src"));
        assert!(!has(list, "rust-s") && !has(list, "rustc") && !has("", "miri"));
    }

    #[test]
    fn cargo_of_the_nightly_toolchain_does_not_inherit_the_toolchain() {
        let command = cargo();
        assert!(command.get_envs().any(|(key, value)| key == "RUSTUP_TOOLCHAIN" && value.is_none()));
        assert_eq!(command.get_args().collect::<Vec<_>>(), ["run", "nightly", "cargo"]);
    }
}
