//! Passes the linker scripts of the emulated board to the linker.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var_os("CARGO_FEATURE_MPS2_AN386").is_none() {
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
    let root = format!("{package}/..");
    for (folder, scripts) in [(root, &["memory.x"][..]), (stack, &["stack.x"]), (package, &["flash.x", "device.x"])] {
        println!("cargo:rustc-link-search={folder}");
        for script in scripts {
            println!("cargo:rerun-if-changed={folder}/{script}");
        }
    }
    // nmagic: no padding to page size, which would move the sections to other flash addresses.
    for arg in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={arg}");
        println!("cargo:rustc-link-arg-examples={arg}");
    }
}
