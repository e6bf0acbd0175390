//! `cargo xtask test`: every check and test, in order.

use anyhow::Result;
use xtask::{setup, shell};

use crate::steps::{self, Progress, Step};

/// What a slip of the hand breaks.
const FIRST: &[Step] = &[Step::new("format", &["fmt", "--all", "--check"])];

/// Steps that build in the folder of the development profile, first the program that the last steps beside them start. Without a board the firmware's library is an ordinary one.
const HOST: &[Step] = &[
    Step::new("emulation", &["build", "--quiet", "--package", "emulation"]),
    Step::new("lint host", &["clippy", "--workspace", "--all-targets", "--", "-Dwarnings"]),
    Step::new("document", &["doc", "--no-deps", "--workspace"]).with("RUSTDOCFLAGS", "-Dwarnings"),
    Step::new("test", &["test", "--workspace"]),
];

/// Steps that build in other folders, and so need not wait for the first. Each image is linted for its board alone, with and without the
/// optional features, because an image with a feature hides what is left out without it. Of the six images `boot` runs the first and
/// the one that differs from it in everything.
const BESIDE: &[Step] = &[
    Step::new("lint nucleo", &lint("-pfirmware", "nucleo-g474re")),
    Step::new("all nucleo", &lint("-pfirmware", "nucleo-g474re,fast,robust,isolation,kilovolt")),
    Step::new("lint mps2", &lint("-ptest-bench", "mps2-an386")),
    Step::new("all mps2", &lint("-ptest-bench", "mps2-an386,fast,robust,isolation,kilovolt")),
    Step::new("build vsj", &["build", "--release", "-p", "host-sim", "--bin", "vsj"]),
    Step::xtask("python", &["python"]),
    Step::xtask("prove", &["prove", "--ticks", "1000000"]),
    Step::emulation("firmware", &["proof"]),
    Step::emulation("boot", &["boot"]),
    Step::emulation("boot both", &["boot", "--controller", "fast", "--limit-v", "1000"]),
    Step::emulation("clients", &["clients"]),
    Step::emulation("story", &["story", "--check"]),
    Step::emulation("c library", &["capi"]),
];

#[rustfmt::skip]
const fn lint(package: &'static str, features: &'static str) -> [&'static str; 13] {
    ["clippy", package, "--lib", "--bins", "--examples", "--profile", "firmware", "--target", shell::MCU,
     "--features", features, "--", "-Dwarnings"]
}

/// The steps for `--help`.
pub(crate) fn help() -> String {
    format!(
        "Steps; the first that fails ends the run:\n  setup      cargo xtask setup\n{}\nthen\n{}\nand, beside these,\n{}",
        steps::help(FIRST),
        steps::help(HOST),
        steps::help(BESIDE)
    )
}

/// Runs every step; an error names the first that fails.
pub(crate) fn run() -> Result<()> {
    let progress = Progress::of(1 + FIRST.len() + HOST.len() + BESIDE.len());
    progress.begin("setup");
    setup::run()?;
    for step in FIRST {
        progress.begin(step.name);
        step.run()?;
    }
    steps::run_beside(HOST, BESIDE, &progress)?;
    progress.end();
    Ok(())
}
