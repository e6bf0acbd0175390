//! Command lines in sequence, for `cargo xtask check` and `cargo xtask test`.

use std::env;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::panic::resume_unwind;
use std::process::Command;
use std::slice;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use xtask::shell;

/// What a step starts.
#[derive(Clone, Copy)]
enum Program {
    Cargo,
    /// This program again.
    Xtask,
    /// The program that verifies the firmware's images. It has to be built: cargo would wait for a build in the same folder.
    Emulation,
}

/// One command line.
pub(crate) struct Step {
    /// At most 10 characters.
    pub(crate) name: &'static str,
    program: Program,
    args: &'static [&'static str],
    /// A variable of its environment.
    env: Option<(&'static str, &'static str)>,
}

impl Step {
    /// A call of cargo.
    pub(crate) const fn new(name: &'static str, args: &'static [&'static str]) -> Self {
        Self { name, program: Program::Cargo, args, env: None }
    }

    /// Another command of this program.
    pub(crate) const fn xtask(name: &'static str, args: &'static [&'static str]) -> Self {
        Self { program: Program::Xtask, ..Self::new(name, args) }
    }

    /// A command of the emulation.
    pub(crate) const fn emulation(name: &'static str, args: &'static [&'static str]) -> Self {
        Self { program: Program::Emulation, ..Self::new(name, args) }
    }

    /// Returns this step with a variable of its environment.
    pub(crate) const fn with(self, key: &'static str, value: &'static str) -> Self {
        Self { env: Some((key, value)), ..self }
    }

    fn command(&self) -> Result<Command> {
        // By name: a build beside this may have replaced the file of this program.
        let built = |name| env::current_exe().map(|own| own.with_file_name(name)).context("cannot find this program");
        let mut command = match self.program {
            Program::Cargo => shell::cargo(),
            Program::Xtask => shell::command(built("xtask")?),
            Program::Emulation => shell::command(built("emulation")?),
        };
        // What a step starts is what was built before, and not built again for speed.
        command.args(self.args).env("VSJ", built("vsj")?).envs(self.env);
        Ok(command)
    }

    pub(crate) fn run(&self) -> Result<()> {
        shell::run(&mut self.command()?)
    }

    /// Runs the step, then prints its output, so that it does not mix with that of a step beside it.
    fn run_beside(&self) -> Result<()> {
        let output = self.command()?.output().with_context(|| format!("cannot start step `{}`", self.name))?;
        let mut all = output.stderr;
        all.extend(output.stdout);
        io::stderr().lock().write_all(&all)?;
        ensure!(output.status.success(), "step `{}` failed ({})", self.name, output.status);
        Ok(())
    }
}

/// What is run in two lanes: `build`, then `host`; beside them `beside`. Both then share `built`, which starts what the lanes have built.
pub(crate) struct Lanes {
    pub(crate) build: Step,
    pub(crate) host: &'static [Step],
    pub(crate) beside: &'static [Step],
    pub(crate) built: &'static [Step],
}

impl Lanes {
    /// Number of steps.
    pub(crate) const fn count(&self) -> usize {
        1 + self.host.len() + self.beside.len() + self.built.len()
    }

    /// Runs every step. After the first that fails no other is begun.
    pub(crate) fn run(&self, progress: &Progress) -> Result<()> {
        let failed = AtomicBool::new(false);
        let each = |steps: &[Step], run: fn(&Step) -> Result<()>| -> Result<()> {
            for step in steps {
                if failed.load(Ordering::Relaxed) {
                    break;
                }
                progress.begin(step.name);
                run(step).inspect_err(|_| failed.store(true, Ordering::Relaxed))?;
            }
            Ok(())
        };
        let each = &each;
        // The next step of `built` is taken by the lane that is free first.
        let taken = &AtomicUsize::new(0);
        let share = move || {
            while let Some(step) = self.built.get(taken.fetch_add(1, Ordering::Relaxed)) {
                each(slice::from_ref(step), Step::run_beside)?;
            }
            Ok(())
        };
        let (has_built, wait_built) = mpsc::channel();
        let (is_prepared, wait_prepared) = mpsc::channel();
        // Where a lane ends without its message, it has failed.
        let host = move || {
            // Dropped where the lane ends, which the other one waits for.
            let has_built = has_built;
            each(slice::from_ref(&self.build), Step::run)?;
            let _ = has_built.send(());
            each(self.host, Step::run)?;
            if wait_prepared.recv().is_ok() { share() } else { Ok(()) }
        };
        let beside = move || {
            each(self.beside, Step::run_beside)?;
            let _ = is_prepared.send(());
            if wait_built.recv().is_ok() { share() } else { Ok(()) }
        };
        thread::scope(|scope| {
            let beside = scope.spawn(beside);
            host().and(beside.join().unwrap_or_else(|panic| resume_unwind(panic)))
        })
    }
}

/// The steps for `--help`: name and command line of each.
pub(crate) fn help(steps: &[Step]) -> String {
    steps.iter().fold(String::new(), |mut help, Step { name, program, args, env }| {
        let env = env.map(|(key, value)| format!("{key}={value} ")).unwrap_or_default();
        let program = match program {
            Program::Cargo => "cargo",
            Program::Xtask | Program::Emulation => "cargo xtask",
        };
        let _ = writeln!(help, "  {name:<10} {env}{program} {}", args.join(" "));
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const FAILS: Step = Step::new("build", &["no-such-command"]);

    #[test]
    fn a_build_that_fails_ends_both_lanes() {
        let (ended, wait) = mpsc::channel();
        thread::spawn(move || {
            let lanes = Lanes { build: FAILS, host: &[], beside: &[], built: &[FAILS] };
            ended.send(lanes.run(&Progress::of(lanes.count())).is_err())
        });
        assert_eq!(wait.recv_timeout(Duration::from_secs(60)), Ok(true));
    }
}
