//! Every check and test, in order.

use std::fmt::Write;
use std::time::Instant;

use anyhow::Result;

use crate::{setup, shell};

/// One call of cargo.
struct Step {
    name: &'static str,
    args: &'static [&'static str],
    env: Option<(&'static str, &'static str)>,
}

/// Quick checks first. The firmware is built for its own target only, so it is excluded wherever the host's is meant.
const STEPS: &[Step] = &[
    Step { name: "format", args: &["fmt", "--all", "--check"], env: None },
    Step {
        name: "lint host",
        args: &["clippy", "--workspace", "--exclude", "firmware", "--all-targets", "--", "-Dwarnings"],
        env: None,
    },
    Step {
        name: "lint MCU",
        args: &["clippy", "-p", "firmware", "--profile", "firmware", "--target", shell::MCU, "--", "-Dwarnings"],
        env: None,
    },
    Step {
        name: "document",
        args: &["doc", "--no-deps", "--workspace", "--exclude", "firmware"],
        env: Some(("RUSTDOCFLAGS", "-Dwarnings")),
    },
    Step { name: "test", args: &["test", "--workspace", "--exclude", "firmware"], env: None },
    Step { name: "build vsj", args: &["build", "--release", "-p", "host-sim", "--bin", "vsj"], env: None },
    Step {
        name: "build MCU",
        args: &["build", "-p", "firmware", "--profile", "firmware", "--target", shell::MCU],
        env: None,
    },
];

/// The steps, for `--help`.
pub(crate) fn help() -> String {
    let mut help = String::from("Steps, stopping at the first that fails:\n  setup      cargo xtask setup\n");
    for Step { name, args, env } in STEPS {
        let env = env.map(|(key, value)| format!("{key}={value} ")).unwrap_or_default();
        let _ = writeln!(help, "  {name:<10} {env}cargo {}", args.join(" "));
    }
    help
}

/// `cargo xtask test`.
pub(crate) fn run() -> Result<()> {
    let start = Instant::now();
    let total = STEPS.len() + 1;
    eprintln!("[1/{total}] setup");
    setup::run()?;
    for (number, Step { name, args, env }) in (2..).zip(STEPS) {
        eprintln!("[{number}/{total}] {name}");
        shell::run(shell::cargo().args(*args).envs(*env))?;
    }
    eprintln!("all {total} steps passed in {} s", start.elapsed().as_secs());
    Ok(())
}
