//! Passes the linker scripts of the board to the linker, and the git revision to the log.

mod revision;

use std::env;

fn main() {
    revision::set();
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=revision.rs");
    if env::var_os("CARGO_FEATURE_NUCLEO_G474RE").is_none() {
        return;
    }
    // memory.x of the workspace includes the board's flash.x and the controller's stack.x.
    let package = env::var("CARGO_MANIFEST_DIR").unwrap();
    let has = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    let stack = match (has("ADAPTATION"), has("ROBUST"), has("ISOLATION")) {
        (true, ..) => "adaptation",
        (_, true, _) => "robust",
        (_, _, true) => "isolation",
        _ => "usual",
    };
    let stack = format!("{package}/../stack/{stack}");
    for (folder, script) in [(format!("{package}/.."), "memory.x"), (stack, "stack.x"), (package, "flash.x")] {
        println!("cargo:rustc-link-search={folder}");
        println!("cargo:rerun-if-changed={folder}/{script}");
    }
    // nmagic: no padding to page size, which would move the sections to other flash addresses.
    for arg in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={arg}");
    }
}
