//! `cargo xtask test`: every check and test, in order.

use anyhow::Result;
use xtask::{setup, shell};

use crate::emulation;
use crate::package;
use crate::prove;
use crate::steps::{self, Progress, Step};

/// Calls of cargo, the quick ones first. Without a board the firmware's library is an ordinary one. Each image is
/// linted for its board alone, with and without the optional features, because an image with a feature hides what is
/// left out without it.
const STEPS: &[Step] = &[
    Step::new("format", &["fmt", "--all", "--check"]),
    Step::new("lint host", &["clippy", "--workspace", "--all-targets", "--", "-Dwarnings"]),
    Step::new("lint nucleo", &lint("-pfirmware", "nucleo-g474re")),
    Step::new("all nucleo", &lint("-pfirmware", "nucleo-g474re,fast,feedback,kilovolt")),
    Step::new("lint mps2", &lint("-ptest-bench", "mps2-an386")),
    Step::new("all mps2", &lint("-ptest-bench", "mps2-an386,fast,feedback,kilovolt")),
    Step { name: "document", args: &["doc", "--no-deps", "--workspace"], env: Some(("RUSTDOCFLAGS", "-Dwarnings")) },
    Step::new("test", &["test", "--workspace"]),
    Step::new("build vsj", &["build", "--release", "-p", "host-sim", "--bin", "vsj"]),
];

/// Command lines of the emulation, the long ones first. Of the four images `boot` runs the first and the one that differs from it in
/// everything.
const EMULATION: &[(&str, &[&str])] = &[
    ("firmware", &["proof"]),
    ("boot", &["boot"]),
    ("boot both", &["boot", "--controller", "fast", "--limit-v", "1000"]),
    ("story", &["story", "--check"]),
    ("c library", &["capi"]),
];

#[rustfmt::skip]
const fn lint(package: &'static str, features: &'static str) -> [&'static str; 13] {
    ["clippy", package, "--lib", "--bins", "--examples", "--profile", "firmware", "--target", shell::MCU,
     "--features", features, "--", "-Dwarnings"]
}

/// The steps for `--help`.
pub(crate) fn help() -> String {
    let line = |(name, args): &(&str, &[&str])| format!("  {name:<10} cargo xtask {}\n", args.join(" "));
    let emulation: String = EMULATION.iter().map(line).collect();
    let python = "  python     cargo xtask python\n  prove      cargo xtask prove --ticks 1000000\n";
    let setup = "  setup      cargo xtask setup\n";
    format!(
        "Steps, stopping at the first that fails, the last {} two at a time:\n{setup}{}{python}{emulation}",
        EMULATION.len(),
        steps::help(STEPS)
    )
}

/// Runs every step; an error names the first that fails.
pub(crate) fn run() -> Result<()> {
    let progress = Progress::of(3 + STEPS.len() + EMULATION.len());
    progress.begin("setup");
    setup::run()?;
    for step in STEPS {
        progress.begin(step.name);
        step.run()?;
    }
    progress.begin("python");
    package::run()?;
    progress.begin("prove");
    prove::run(&prove::Args::SHARE)?;
    emulation::run_all(EMULATION, |name| progress.begin(name))?;
    progress.end();
    Ok(())
}
