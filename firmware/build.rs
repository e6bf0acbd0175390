//! Passes the linker scripts of the board to the linker, and the git revision to the log.

use std::{env, process::Command};

fn main() {
    revision();
    println!("cargo:rerun-if-changed=build.rs");
    if env::var_os("CARGO_FEATURE_NUCLEO_G474RE").is_none() {
        return;
    }
    // memory.x of the workspace includes the board's flash.x.
    let package = env::var("CARGO_MANIFEST_DIR").unwrap();
    for (folder, script) in [(format!("{package}/.."), "memory.x"), (package, "flash.x")] {
        println!("cargo:rustc-link-search={folder}");
        println!("cargo:rerun-if-changed={folder}/{script}");
    }
    // nmagic: no padding to page size, which would move the sections to other flash addresses.
    for arg in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={arg}");
    }
}

/// Sets `GIT_REVISION`, which is `unknown` in a source archive without git history.
fn revision() {
    let git = |args: &[&str]| {
        let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    println!("cargo:rustc-env=GIT_REVISION={}", git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or("unknown".into()));
    if let Some(log) = git(&["rev-parse", "--path-format=absolute", "--git-path", "logs/HEAD"]) {
        println!("cargo:rerun-if-changed={log}");
    }
}
