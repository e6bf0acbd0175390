//! `cargo xtask check`: the checks for every edit.

use anyhow::Result;

use crate::steps::{self, Progress, Step};

/// Clippy also compiles what the tests need, so a type error appears before a test is built.
const STEPS: &[Step] = &[
    Step::new("format", &["fmt", "--all", "--check"]),
    Step::new("lint", &["clippy", "--workspace", "--all-targets", "--", "-Dwarnings"]),
    Step::new("test", &["test", "--workspace", "--lib", "--bins"]),
    Step::new("doc test", &["test", "-p", "vsj-model", "--doc"]),
];

/// The steps for `--help`.
pub(crate) fn help() -> String {
    let left_out =
        "Left out, and part of `test`: integration tests, the MCU's target, documentation, images, the emulator.";
    format!("Steps, stopping at the first that fails:\n{}\n{left_out}", steps::help(STEPS))
}

/// Runs every step; an error names the first that fails.
pub(crate) fn run() -> Result<()> {
    let progress = Progress::of(STEPS.len());
    for step in STEPS {
        progress.begin(step.name);
        step.run()?;
    }
    progress.end();
    Ok(())
}
