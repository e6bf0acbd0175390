//! Every check and test, in order.

use std::fmt::Write;
use std::time::Instant;

use anyhow::Result;

use crate::variant::Variant;
use crate::{boot, proof, setup, shell, story};

/// One call of cargo.
struct Step {
    name: &'static str,
    args: &'static [&'static str],
    env: Option<(&'static str, &'static str)>,
}

/// Quick checks first. Without a board the firmware's library is an ordinary one; each image is for its board alone, and
/// what its features leave out is not seen in one that has them.
const STEPS: &[Step] = &[
    Step { name: "format", args: &["fmt", "--all", "--check"], env: None },
    Step { name: "lint host", args: &["clippy", "--workspace", "--all-targets", "--", "-Dwarnings"], env: None },
    Step { name: "lint nucleo", args: &lint("-pfirmware", "nucleo-g474re"), env: None },
    Step { name: "all nucleo", args: &lint("-pfirmware", "nucleo-g474re,fast,feedback,kilovolt"), env: None },
    Step { name: "lint mps2", args: &lint("-ptest-bench", "mps2-an386"), env: None },
    Step { name: "all mps2", args: &lint("-ptest-bench", "mps2-an386,fast,feedback,kilovolt"), env: None },
    Step { name: "document", args: &["doc", "--no-deps", "--workspace"], env: Some(("RUSTDOCFLAGS", "-Dwarnings")) },
    Step { name: "test", args: &["test", "--workspace"], env: None },
    Step { name: "build vsj", args: &["build", "--release", "-p", "host-sim", "--bin", "vsj"], env: None },
];

#[rustfmt::skip]
const fn lint(package: &'static str, features: &'static str) -> [&'static str; 13] {
    ["clippy", package, "--lib", "--bins", "--examples", "--profile", "firmware", "--target", shell::MCU,
     "--features", features, "--", "-Dwarnings"]
}

/// The steps, for `--help`.
pub(crate) fn help() -> String {
    let mut help = String::from("Steps, stopping at the first that fails:\n  setup      cargo xtask setup\n");
    for Step { name, args, env } in STEPS {
        let env = env.map(|(key, value)| format!("{key}={value} ")).unwrap_or_default();
        let _ = writeln!(help, "  {name:<10} {env}cargo {}", args.join(" "));
    }
    help + "  firmware   cargo xtask proof\n  boot       cargo xtask boot; --controller fast --limit-v 1000\n  story      cargo xtask story, as approved; a sensor that falls silent\n"
}

/// `cargo xtask test`.
pub(crate) fn run() -> Result<()> {
    let start = Instant::now();
    let total = STEPS.len() + 4;
    let begin = |number: usize, name| eprintln!("[{number}/{total}] {name}, after {} s", start.elapsed().as_secs());
    begin(1, "setup");
    setup::run()?;
    for (number, Step { name, args, env }) in (2..).zip(STEPS) {
        begin(number, name);
        shell::run(shell::cargo().args(*args).envs(*env))?;
    }
    begin(total - 2, "firmware");
    proof::run()?;
    begin(total - 1, "boot");
    for variant in Variant::BOOTED {
        boot::run(variant)?;
    }
    begin(total, "story");
    story::check()?;
    eprintln!("all {total} steps passed in {} s", start.elapsed().as_secs());
    Ok(())
}
