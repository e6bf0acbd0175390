//! `cargo xtask flash` on a machine that is not ready for it.

use std::process::Command;

#[test]
fn without_probe_rs_it_says_so_before_anything_is_built() {
    let output = Command::new(env!("CARGO_BIN_EXE_xtask")).arg("flash").env("PATH", "").output().expect("xtask");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(!said.contains("cargo build"), "{said}");
    assert!(
        said.contains("cargo install probe-rs-tools --locked") && said.contains("`probe-rs` is not installed"),
        "{said}"
    );
}
