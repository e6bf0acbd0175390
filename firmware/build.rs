//! Hands the board's memory map and the linker scripts to the linker, and the revision to the log.

use std::{env, fs, path::PathBuf, process::Command};

fn main() {
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap());
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap());
    revision();

    let has = |feature| env::var_os(feature).is_some();
    let flash = match (has("CARGO_FEATURE_NUCLEO_G474RE"), has("CARGO_FEATURE_MPS2_AN386")) {
        (false, false) => return,
        (true, true) => panic!("one board at a time: nucleo-g474re or mps2-an386"),
        // The first of two banks, as the chip is delivered (option bit DBANK = 1); in the second are the store's pages.
        (true, false) => "0x08000000",
        (false, true) => "0x00000000",
    };
    fs::write(out.join("flash.x"), format!("MEMORY {{ FLASH : ORIGIN = {flash}, LENGTH = 256K }}\n")).unwrap();
    // link.x includes the work tree's memory.x by its bare name.
    let memory = package.join("../memory.x");
    fs::copy(&memory, out.join("memory.x")).unwrap_or_else(|e| panic!("cannot copy {}: {e}", memory.display()));
    if has("CARGO_FEATURE_MPS2_AN386") {
        // No peripheral crate for this board: its interrupt names are in mps2/vectors.rs.
        fs::write(out.join("device.x"), "").unwrap();
    }
    println!("cargo:rustc-link-search={}", out.display());

    // nmagic: no padding to page size, which would move the sections away from where flash needs them.
    for arg in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={arg}");
        println!("cargo:rustc-link-arg-examples={arg}");
    }
    println!("cargo:rerun-if-changed={}", memory.display());
    println!("cargo:rerun-if-changed=build.rs");
}

/// `GIT_REVISION` for the boot line; an archive without git history says so.
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
