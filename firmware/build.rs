//! Hands `memory.x` and the linker scripts to the linker.

use std::{env, fs, path::PathBuf};

fn main() {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap()).join("..");
    let memory = root.join("memory.x");
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap());

    // cortex-m-rt's link.x includes `memory.x` by its bare name, so it needs a place on the search path.
    fs::copy(&memory, out.join("memory.x")).unwrap_or_else(|e| panic!("cannot copy {}: {e}", memory.display()));
    println!("cargo:rustc-link-search={}", out.display());

    // nmagic: no padding to page size, which would move the sections away from where flash needs them.
    for arg in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={arg}");
    }
    println!("cargo:rerun-if-changed={}", memory.display());
    println!("cargo:rerun-if-changed=build.rs");
}
