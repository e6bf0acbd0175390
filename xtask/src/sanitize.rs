//! `cargo xtask sanitize`: the tests of the code that the MCU runs, under Miri and under the address sanitizer.
//!
//! Both need a nightly toolchain. Miri interprets the program and stops at undefined behaviour: it is some hundred times
//! slower, so property tests draw few cases and tests of millions of ticks are left out. The address sanitizer runs all
//! tests. Overflow checks are on in both, as in every test.

use anyhow::{Context, Result};
use xtask::shell;

/// Tests of millions of ticks, which Miri would need hours for; their code is reached by others.
const LONG: &[&str] = &[
    "a_step_response",
    "the_charge_and_its_mean",
    "a_lag_of_one_millivolt",
    "the_gain_is_that_of_the_steady",
    "an_oscillation",
    "crossing",
    "the_mean_slew",
    "power_cut",
    "both_stores",
    "without_an_error",
    "overflow",
];

/// Cases of a property test under Miri.
const CASES: &str = "4";

/// Packages with the code of the control tick and of the link; the integration tests of `model` are all long.
const INTERPRETED: &[&[&str]] = &[&["-p", "link"], &["-p", "model", "--lib"], &["-p", "firmware", "--lib"]];

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
        nightly("miri")?;
        for packages in INTERPRETED {
            let mut command = rustup_cargo();
            command.args(["miri", "test"]).args(*packages).arg("--");
            LONG.iter().for_each(|name| _ = command.args(["--skip", name]));
            command.env("PROPTEST_CASES", CASES).env("MIRIFLAGS", "-Zmiri-disable-isolation");
            shell::run(command.env("CARGO_TARGET_DIR", target.join("miri")))?;
        }
    }
    if chosen("address") {
        nightly("rust-src")?;
        let host = host()?;
        let mut command = rustup_cargo();
        command.args(["test", "-p", "model", "-p", "link", "-p", "firmware", "--tests", "--target", &host]);
        command.env("RUSTFLAGS", "-Zsanitizer=address").env("CARGO_TARGET_DIR", target.join("sanitize"));
        shell::run(&mut command)?;
    }
    println!("no undefined behaviour, no overflow, no invalid access");
    Ok(())
}

/// Cargo of the nightly toolchain. The one that started this command must not choose the toolchain.
fn rustup_cargo() -> std::process::Command {
    let mut command = shell::command("rustup");
    command.args(["run", "nightly", "cargo"]).env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO").env_remove("RUSTC");
    command
}

/// Installs the nightly toolchain with a component if that is missing.
fn nightly(component: &str) -> Result<()> {
    let list = ["component", "list", "--installed", "--toolchain", "nightly"];
    let installed = shell::output(shell::command("rustup").args(list)).unwrap_or_default();
    if installed.lines().any(|line| line.starts_with(component)) {
        return Ok(());
    }
    eprintln!("sanitize: {component} of the nightly toolchain is missing, installing it");
    let install = ["toolchain", "install", "nightly", "--profile", "minimal", "--no-self-update", "--component"];
    shell::run(shell::command("rustup").args(install).args([component, "rust-src"]))
        .context("a nightly toolchain with Miri is needed")
}

/// The host's target triple.
fn host() -> Result<String> {
    let text = shell::output(shell::command("rustc").arg("-vV"))?;
    let host = text.lines().find_map(|line| line.strip_prefix("host: ")).context("rustc names no host")?;
    Ok(host.to_owned())
}
