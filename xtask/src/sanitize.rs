//! `cargo xtask sanitize`: the tests of the code that the MCU runs, under Miri and under the address sanitizer.
//!
//! Both need a nightly toolchain. Miri interprets the program and stops at undefined behaviour: it is some hundred times
//! slower, so property tests draw few cases, and tests of very many ticks or frames have the attribute
//! `cfg_attr(miri, ignore)`. The address sanitizer runs all tests. Overflow checks are on in both, as in every test.

use anyhow::{Context, Result};
use xtask::shell;

use crate::nightly;

/// Cases of a property test under Miri.
const CASES: &str = "4";

/// Every part of the tick that an image may have.
const FEATURES: &str = "firmware/fast,firmware/robust,firmware/adaptation";

/// Packages with the code of the control tick and of the link; the integration tests of `model` are all long.
/// Miri does not know the instructions with which libm computes a square root; in integers it gives the same bits.
const INTERPRETED: &[&[&str]] = &[
    &["-p", "vsj-link"],
    &["-p", "vsj-model", "-p", "firmware", "--lib", "--features", FEATURES, "--features", "libm/force-soft-floats"],
];

/// Arguments of `cargo xtask sanitize`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Only this half
    #[arg(long, value_parser = ["miri", "address"])]
    only: Option<String>,
}

/// Runs both, and installs what of the nightly toolchain is missing.
pub(crate) fn run(args: &Args) -> Result<()> {
    let chosen = |name: &str| args.only.as_deref().is_none_or(|only| only == name);
    let target = shell::target_directory()?;
    if chosen("miri") {
        nightly::install("miri")?;
        for packages in INTERPRETED {
            let mut command = nightly::cargo();
            command.args(["miri", "test"]).args(*packages);
            command.env("PROPTEST_CASES", CASES).env("MIRIFLAGS", "-Zmiri-disable-isolation");
            shell::run(command.env("CARGO_TARGET_DIR", target.join("miri")))?;
        }
    }
    if chosen("address") {
        nightly::install("rust-src")?;
        let host = host()?;
        let mut command = nightly::cargo();
        command.args(["test", "-p", "vsj-model", "-p", "vsj-link", "-p", "firmware", "--tests"]);
        command.args(["--features", FEATURES, "--target", &host]);
        command.env("RUSTFLAGS", "-Zsanitizer=address").env("CARGO_TARGET_DIR", target.join("sanitize"));
        shell::run(&mut command)?;
    }
    println!("no undefined behaviour, no overflow, no invalid access");
    Ok(())
}

/// The host's target triple.
fn host() -> Result<String> {
    let text = shell::output(shell::command("rustc").arg("-vV"))?;
    let host = text.lines().find_map(|line| line.strip_prefix("host: ")).context("rustc names no host")?;
    Ok(host.to_owned())
}
