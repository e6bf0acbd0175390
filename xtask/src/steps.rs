//! Calls of cargo in sequence, for `cargo xtask check` and `cargo xtask test`.

use std::fmt::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::Result;
use xtask::shell;

/// One call of cargo.
pub(crate) struct Step {
    /// At most 10 characters.
    pub(crate) name: &'static str,
    /// Arguments of cargo.
    pub(crate) args: &'static [&'static str],
    /// A variable of its environment.
    pub(crate) env: Option<(&'static str, &'static str)>,
}

impl Step {
    pub(crate) const fn new(name: &'static str, args: &'static [&'static str]) -> Self {
        Self { name, args, env: None }
    }

    pub(crate) fn run(&self) -> Result<()> {
        shell::run(shell::cargo().args(self.args).envs(self.env))
    }
}

/// The steps for `--help`: name and command line of each.
pub(crate) fn help(steps: &[Step]) -> String {
    steps.iter().fold(String::new(), |mut help, Step { name, args, env }| {
        let env = env.map(|(key, value)| format!("{key}={value} ")).unwrap_or_default();
        let _ = writeln!(help, "  {name:<10} {env}cargo {}", args.join(" "));
        help
    })
}

/// Counts steps on stderr, each with the time since the start.
pub(crate) struct Progress {
    start: Instant,
    number: AtomicUsize,
    total: usize,
}

impl Progress {
    pub(crate) fn of(total: usize) -> Self {
        Self { start: Instant::now(), number: AtomicUsize::new(0), total }
    }

    pub(crate) fn begin(&self, name: &str) {
        let number = 1 + self.number.fetch_add(1, Ordering::Relaxed);
        eprintln!("[{number}/{}] {name}, after {} s", self.total, self.start.elapsed().as_secs());
    }

    pub(crate) fn end(self) {
        eprintln!("all {} steps passed in {} s", self.total, self.start.elapsed().as_secs());
    }
}
