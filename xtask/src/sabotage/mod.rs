//! `cargo xtask sabotage`: breaks each promise on purpose, and demands that what stands beside it in `docs/promises.md` fails.
//!
//! In: `.cargo/sabotages.toml`, the list of changes, each with the test, drill or boot run that must notice it. Out: a line for
//! each on stdout, and counts. It fails if one is not noticed. All of it takes place in a copy of the sources, which stays in the target
//! directory: the next run compiles what has changed, and overwrites what an interrupted one has left.

mod evidence;
mod list;

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fmt;
use std::fs::File;
use std::path::PathBuf;
use std::process::{Command, Output};

use anyhow::{Context, Result, bail, ensure};
use xtask::tally::Tally;
use xtask::{files, shell};

use evidence::{Evidence, PROFILE, Program};
use list::{FILE, List, Sabotage};

/// Arguments of `cargo xtask sabotage`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Only where the test, drill or boot run has this word in its name
    #[arg(long, value_name = "WORD")]
    only: Vec<String>,
    /// Only tests that run on the host: no drills, no boot runs
    #[arg(long)]
    host: bool,
}

/// Tries every sabotage and prints the counts.
pub(crate) fn run(args: &Args) -> Result<()> {
    let list = List::read()?;
    let is_chosen = |sabotage: &&Sabotage| {
        let name = sabotage.evidence.to_string();
        let is_on_host = matches!(sabotage.evidence, Evidence::Test(..));
        (is_on_host || !args.host) && (args.only.is_empty() || args.only.iter().any(|word| name.contains(word)))
    };
    let chosen: Vec<&Sabotage> = list.sabotages.iter().filter(is_chosen).collect();
    ensure!(!chosen.is_empty(), "no sabotage in {FILE} has such a name");
    let folder = shell::target_directory()?.join("sabotage");
    let copy = Copy { tree: folder.join("tree"), build: folder.join("build") };
    files::make(&folder)?;
    // Another run would change the same files.
    let turn = File::create(folder.join("turn.lock")).context("cannot make a lock")?;
    turn.lock().context("cannot wait for a lock")?;
    files::copy_tracked(&copy.tree)?;

    let evidence: BTreeSet<&Evidence> = chosen.iter().map(|sabotage| &sabotage.evidence).collect();
    let names = copy.passes(&evidence).context("the unbroken copy does not pass")?;
    let mut counts = Counts::default();
    for sabotage in chosen {
        let before = sabotage.apply(&copy.tree)?;
        let outcome = copy.is_noticed(&sabotage.evidence, &names);
        files::write(&copy.tree.join(&sabotage.file), before)?;
        let Sabotage { evidence, file, .. } = sabotage;
        match outcome {
            Ok(true) => {
                counts.noticed += 1;
                println!("noticed: {evidence} ({file})");
            }
            Ok(false) => {
                counts.unnoticed += 1;
                println!("NOT NOTICED: {evidence} ({file})");
            }
            Err(error) => {
                counts.errors += 1;
                println!("ERROR: {evidence} ({file}): {error:#}");
            }
        }
    }
    for (evidence, reason) in &list.without {
        println!("without a sabotage: {evidence}: {reason}");
    }
    println!("{counts}");
    ensure!(counts.unnoticed == 0 && counts.errors == 0, "a sabotage is not noticed, or could not be tried");
    if args.only.is_empty() {
        let what = "sabotages of a promise, each noticed".to_owned();
        Tally::now([(what, counts.noticed)])?.write(if args.host { "sabotage-host" } else { "sabotage" })?;
    }
    Ok(())
}

/// How many sabotages were noticed, were not, or could not be tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts {
    noticed: u64,
    unnoticed: u64,
    errors: u64,
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} noticed, {} not noticed, {} errors", self.noticed, self.unnoticed, self.errors)
    }
}

/// The copy of the sources, and what is built of it.
struct Copy {
    tree: PathBuf,
    build: PathBuf,
}

/// The whole name of each test in its program.
type Names = BTreeMap<Evidence, String>;

impl Copy {
    /// Runs all the evidence on the copy as it is. An error if one fails; else the names of its tests.
    fn passes(&self, evidence: &BTreeSet<&Evidence>) -> Result<Names> {
        let mut programs: BTreeMap<Vec<String>, Vec<(&Evidence, &str, String)>> = BTreeMap::new();
        let (mut drills, mut runs) = (Vec::new(), Vec::new());
        for one in evidence {
            match one {
                Evidence::Test(file, name) => {
                    let Program { arguments, modules } = Program::of(file)?;
                    programs.entry(arguments).or_default().push((one, name, modules));
                }
                Evidence::Drill(name) => drills.push(name.as_str()),
                Evidence::Boot(name) => runs.push(name.as_str()),
            }
        }
        for (command, names) in [("drill", drills), ("boot", runs)] {
            if !names.is_empty() {
                let output = self.emulate(command, &names)?;
                ensure!(output.status.success(), "{command} fails:\n{}", end(&output));
            }
        }
        let mut names = Names::new();
        for (arguments, tests) in programs {
            let output = self.test(&arguments, tests.iter().map(|(_, name, _)| *name))?;
            for (one, name, modules) in tests {
                names.insert(one.clone(), passed(&output, &modules, name).with_context(|| one.to_string())?);
            }
        }
        Ok(names)
    }

    /// Whether the evidence fails on the copy as it is. An error if it does not run.
    fn is_noticed(&self, evidence: &Evidence, names: &Names) -> Result<bool> {
        match evidence {
            Evidence::Test(file, _) => {
                let name = names.get(evidence).context("no such test")?;
                fails(&self.test(&Program::of(file)?.arguments, ["--exact", name])?)
            }
            Evidence::Drill(name) => fails_with(&self.emulate("drill", &[name])?, &format!("error: drill {name}: ")),
            Evidence::Boot(name) => fails_with(&self.emulate("boot", &[name])?, &format!("error: {name}: ")),
        }
    }

    /// Runs `cargo test` and returns what it prints.
    fn test<'a>(&self, arguments: &[String], filter: impl IntoIterator<Item = &'a str>) -> Result<String> {
        let mut command = self.cargo();
        command.arg("test").args(arguments).arg("--").args(filter);
        // The same random inputs in every run, of which none is kept: one that fails would fail for later sabotages as well.
        command.env("PROPTEST_RNG_SEED", "1").env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1");
        let output = output(&mut command)?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        ensure!(text.contains("\ntest result: "), "no test ran:\n{}", end(&output));
        Ok(text)
    }

    /// Runs the drills or boot runs of these names and returns what they print.
    fn emulate(&self, command: &str, names: &[&str]) -> Result<Output> {
        let mut build = self.cargo();
        build.args([
            "build",
            "--quiet",
            "--workspace",
            "--exclude=vsj-python",
            "--profile",
            PROFILE,
            "--bin=emulation",
        ]);
        let built = output(&mut build)?;
        ensure!(built.status.success(), "it does not compile:\n{}", end(&built));
        let mut program = self.command(self.build.join(PROFILE).join("emulation"));
        output(program.arg(command).args(names.iter().flat_map(|name| ["--only", *name])))
    }

    fn cargo(&self) -> Command {
        self.command(shell::cargo().get_program())
    }

    /// A command in the copy, whose builds go where the others are.
    fn command(&self, program: impl AsRef<OsStr>) -> Command {
        let mut command = Command::new(program);
        command.current_dir(&self.tree).env("CARGO_TARGET_DIR", &self.build);
        // As the profile says.
        command.env_remove("CARGO_INCREMENTAL").env("CARGO_PROFILE_MUTANTS_OPT_LEVEL", "1");
        command
    }
}

/// Runs a command to its end, whatever its exit code.
fn output(command: &mut Command) -> Result<Output> {
    eprintln!("$ {}", shell::line(command));
    command.output().context("cannot start cargo")
}

/// The last lines that a command has printed to stderr.
fn end(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(40)..].join("\n")
}

/// The whole name of the test `name` below `modules` in the output of a program of tests. An error unless it is the only one of this
/// name and has passed.
fn passed(output: &str, modules: &str, name: &str) -> Result<String> {
    let is_it = |test: &&str| test.starts_with(modules) && (*test == name || test.ends_with(&format!("::{name}")));
    let tests = output.lines().filter_map(|line| line.strip_prefix("test ")?.split_once(" ... "));
    let found: Vec<(&str, &str)> = tests.filter(|(test, _)| is_it(test)).collect();
    match found.as_slice() {
        [(test, "ok")] => Ok((*test).to_owned()),
        _ => bail!("{found:?} instead of one test that passes"),
    }
}

/// Whether a drill or boot run has failed, which it says in a line that begins with `says`.
fn fails_with(output: &Output, says: &str) -> Result<bool> {
    if output.status.success() {
        return Ok(false);
    }
    let said = String::from_utf8_lossy(&output.stderr).lines().any(|line| line.starts_with(says));
    ensure!(said, "it fails otherwise:\n{}", end(output));
    Ok(true)
}

/// Whether the only test that a program has run has failed.
fn fails(output: &str) -> Result<bool> {
    let count = |word: &str| {
        let results = output.lines().filter(|line| line.starts_with("test result: "));
        let counts =
            results.filter_map(|line| line.split(&['.', ';'][..]).find_map(|part| part.trim().strip_suffix(word)));
        counts.filter_map(|count| count.trim().parse::<u64>().ok()).sum::<u64>()
    };
    match (count("passed"), count("failed")) {
        (1, 0) => Ok(false),
        (0, 1) => Ok(true),
        (passed, failed) => bail!("{passed} tests pass and {failed} fail instead of one"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RESULT: &str =
        "\nrunning 1 test\ntest a::b ... ok\n\ntest result: ok. 1 passed; 0 failed; 0 ignored; 0 measured\n";

    #[test]
    fn only_a_single_test_that_has_run_passes_or_fails() {
        assert!(!fails(RESULT).unwrap());
        assert!(fails(&RESULT.replace("ok. 1 passed; 0 failed", "FAILED. 0 passed; 1 failed")).unwrap());
        assert!(!fails(&(RESULT.to_owned() + "test result: ok. 0 passed; 0 failed; 0 ignored")).unwrap());
        assert!(fails(&(RESULT.to_owned() + RESULT)).is_err());
        assert!(fails("").is_err());
    }

    #[test]
    fn a_test_is_found_by_its_file_and_its_name() {
        assert_eq!(passed(RESULT, "a::", "b").unwrap(), "a::b");
        assert_eq!(passed("test b ... ok", "", "b").unwrap(), "b");
        for (output, modules, name) in [
            (RESULT, "c::", "b"),
            (RESULT, "a::", "c"),
            ("test a::b ... FAILED", "a::", "b"),
            ("test a::b ... ok\ntest a::c::b ... ok", "a::", "b"),
        ] {
            assert!(passed(output, modules, name).is_err(), "{output}");
        }
    }
}
