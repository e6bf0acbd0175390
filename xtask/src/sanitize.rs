//! `cargo xtask sanitize`: the tests of the code that the MCU runs, under Miri and under the address sanitizer.
//!
//! Both need a nightly toolchain. Miri interprets the program and stops at undefined behaviour: it is some hundred times
//! slower, so property tests draw few cases, and tests of very many ticks or frames have the attribute
//! `cfg_attr(miri, ignore)`. The address sanitizer runs all tests. Overflow checks are on in both, as in every test.

use anyhow::{Context, Result};
use xtask::shell;
use xtask::tally::Tally;

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
        let mut tests = 0;
        for packages in INTERPRETED {
            let mut command = nightly::cargo();
            command.args(["miri", "test"]).args(*packages);
            command.env("PROPTEST_CASES", CASES).env("MIRIFLAGS", "-Zmiri-disable-isolation");
            tests += passed(&shell::run_and_read(command.env("CARGO_TARGET_DIR", target.join("miri")))?);
        }
        Tally::now([("tests under Miri, without undefined behaviour".to_owned(), tests)])?.write("sanitize-miri")?;
    }
    if chosen("address") {
        nightly::install("rust-src")?;
        let host = host()?;
        let mut command = nightly::cargo();
        command.args(["test", "-p", "vsj-model", "-p", "vsj-link", "-p", "firmware", "--tests"]);
        command.args(["--features", FEATURES, "--target", &host]);
        command.env("RUSTFLAGS", "-Zsanitizer=address").env("CARGO_TARGET_DIR", target.join("sanitize"));
        let tests = passed(&shell::run_and_read(&mut command)?);
        let what = "tests under the address sanitizer, without an invalid access".to_owned();
        Tally::now([(what, tests)])?.write("sanitize-address")?;
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

/// How many tests have passed, of all test programs in the output of `cargo test`.
fn passed(output: &str) -> u64 {
    let result = |line: &str| line.strip_prefix("test result: ok. ")?.split_once(" passed;")?.0.parse::<u64>().ok();
    output.lines().filter_map(result).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tests_of_all_programs_are_counted() {
        let output = "running 3 tests\ntest result: ok. 2 passed; 0 failed; 1 ignored; 0 measured\n\nrunning 40 tests\n\
                      test result: ok. 40 passed; 0 failed; 0 ignored; 0 measured; 3 filtered out\n";
        assert_eq!(passed(output), 42);
    }
}
