//! `cargo xtask mutants`: changes the code in one place at a time, and counts the changes that no test notices.
//!
//! In: packages, and `.cargo/mutants-survivors.toml`, the list of changes that live with the reason of each. Out: caught
//! and missed changes by package on stdout. It fails if fewer than [`LEAST_CAUGHT`] are caught, or if a change lives that
//! is not listed. Each change is tried with the quick unit tests first; what they miss is tried again with all tests of its
//! package. A run that was interrupted goes on with `--iterate`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use xtask::shell;
use xtask::tally::Tally;
use xtask::tool::Tool;

const TOOL: Tool = Tool { name: "cargo-mutants", version: "26.0.0" };
/// Smallest share of the changes that must be caught, those that do not compile left out.
const LEAST_CAUGHT: f64 = 0.95;
/// The list of changes that live.
const SURVIVORS: &str = ".cargo/mutants-survivors.toml";
/// The packages whose tests run on a host and that the MCU runs: folder, name, and features beside the default ones.
const PACKAGES: [(&str, &str, &str); 3] =
    [("model", "vsj-model", ""), ("link", "vsj-link", ""), ("firmware", "firmware", "fast,robust,adaptation")];

/// The two passes. The first one compiles without optimisation, which takes a quarter of the time, and leaves out the unit tests that
/// then need most of it.
const PASSES: [Pass; 2] = [
    Pass {
        opt_level: "0",
        tests: &[
            "--cargo-arg=--lib",
            "--cargo-test-arg=--",
            "--cargo-test-arg=--skip=every_state_and_event",
            "--cargo-test-arg=--skip=no_order_of_events_enables_the_output",
            "--cargo-test-arg=--skip=no_controller_remembers_a_limit",
            "--cargo-test-arg=--skip=after_a_limit_the_fast_controller_rests",
            "--cargo-test-arg=--skip=an_exchange_moves_neither_estimate_nor_code",
        ],
    },
    Pass { opt_level: "1", tests: &["--cargo-arg=--tests"] },
];

/// How the changes are tried in one pass.
struct Pass {
    /// `opt-level` of the profile `mutants`.
    opt_level: &'static str,
    /// Arguments of the tool that choose the tests.
    tests: &'static [&'static str],
}

/// Arguments of `cargo xtask mutants`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Package whose code is changed; all three without it
    #[arg(long, value_parser = PACKAGES.map(|(folder, ..)| folder))]
    package: Vec<String>,
    /// Only in files that match this pattern, for example 'model/src/extended/*'
    #[arg(long, value_name = "PATTERN")]
    file: Vec<String>,
    /// A sample: one in this many changes of each package, evenly spread over its code
    #[arg(long, value_name = "N", conflicts_with = "iterate", value_parser = clap::value_parser!(u64).range(2..))]
    every: Option<u64>,
    /// Number of changes that are compiled and tested at the same time
    #[arg(long, default_value_t = 1)]
    jobs: u32,
    /// Try only what the last run has not caught
    #[arg(long)]
    iterate: bool,
}

/// Tries every change and prints the counts.
pub(crate) fn run(args: &Args) -> Result<()> {
    let program = TOOL.program()?;
    let listed = listed()?;
    let asked = |folder: &str| args.package.is_empty() || args.package.iter().any(|package| package == folder);
    let folder = shell::target_directory()?.join("mutants");
    let (mut all, mut unlisted) = (Counts::default(), Vec::new());
    let mut living = BTreeSet::new();
    for (package, name, features) in PACKAGES.into_iter().filter(|(folder, ..)| asked(folder)) {
        let out = folder.join(package);
        fs::create_dir_all(&out).with_context(|| format!("cannot make {}", out.display()))?;
        if args.iterate {
            // The last run may have been interrupted before it kept them.
            keep(&out, true)?;
        }
        for (pass, iterate) in PASSES.iter().zip([args.iterate, true]) {
            let Some(of) = chosen(args, iterate, &out) else { break };
            try_changes(&program, args, (name, features), pass, iterate, &of, &out)?;
            keep(&out, iterate)?;
        }
        let outcomes = Outcomes::read(&out)?;
        println!("{package:<10} {}", outcomes.counts);
        if args.file.is_empty() {
            let sample = args.every.map(|every| ("one in this many changes was tried".to_owned(), every));
            Tally::now(outcomes.counts.named().into_iter().chain(sample))?.write(&format!("mutants-{package}"))?;
        }
        all = all.and(&outcomes.counts);
        for missed in outcomes.missed {
            if !listed.contains_key(&missed.key) {
                unlisted.push(missed.line);
            }
            living.insert(missed.key);
        }
    }
    println!("{:<10} {all}", "in all");
    if args.package.is_empty() && args.file.is_empty() && args.every.is_none() {
        for key in listed.keys().filter(|key| !living.contains(*key)) {
            println!("caught by now, to be deleted from {SURVIVORS}: {key}");
        }
    }
    for line in &unlisted {
        println!("lives, and is not listed: {line}");
    }
    if !unlisted.is_empty() {
        bail!("{} changes live that are not in {SURVIVORS}", unlisted.len());
    }
    if all.share() < LEAST_CAUGHT {
        bail!("{:.1} % caught, at least {:.0} % wanted", 100.0 * all.share(), 100.0 * LEAST_CAUGHT);
    }
    Ok(())
}

/// Arguments of the tool for the changes that a pass tries: those of the files that are asked for, or a sample, of which the second pass
/// tries again what the first one has missed. `None` if there is nothing to try.
fn chosen(args: &Args, again: bool, out: &Path) -> Option<Vec<String>> {
    let mut of: Vec<String> = args.file.iter().flat_map(|file| ["--file".to_owned(), file.clone()]).collect();
    match args.every {
        Some(every) if !again => {
            of.extend(["--sharding=round-robin".to_owned(), format!("--shard=0/{every}")]);
        }
        Some(_) => {
            let missed = lines(&out.join("mutants.out/missed.txt"));
            if missed.is_empty() {
                return None;
            }
            of.extend(missed.iter().map(|line| format!("--re=^{}$", escaped(line))));
        }
        None => {}
    }
    Some(of)
}

/// A regular expression that matches `text`. Escaped letters and angle brackets would have a meaning of their own.
fn escaped(text: &str) -> String {
    let means_something = |c| r"\.+*?()|[]{}^$".contains(c);
    text.chars().flat_map(|c| ['\\'].into_iter().filter(move |_| means_something(c)).chain([c])).collect()
}

/// Runs the tool once for the changes `of`. It exits with 2 or 3 when changes live, which is no failure here.
fn try_changes(
    program: &Path,
    args: &Args,
    (package, features): (&str, &str),
    pass: &Pass,
    iterate: bool,
    of: &[String],
    out: &Path,
) -> Result<()> {
    let mut command = shell::command(program);
    command.args([
        "mutants",
        "--no-shuffle",
        "--colors",
        "never",
        "--minimum-test-timeout",
        "60",
        "--package",
        package,
        "--features",
        features,
    ]);
    command.arg(format!("--jobs={}", args.jobs)).args(pass.tests).arg("--output").arg(out);
    command.args(of);
    // The time limit follows from the tests' own time, which is measured before the first change: on a busy machine a
    // fixed one would count changes as caught that no test has noticed.
    if iterate {
        command.arg("--iterate");
    }
    // Its copies are built with the settings of its own profile, one at a time in a folder that stays, so that dependencies are
    // compiled once.
    command.env_remove("CARGO_INCREMENTAL").env("CARGO_PROFILE_MUTANTS_OPT_LEVEL", pass.opt_level);
    // Each change is tried on the random inputs of the run without one, and none is kept: an input that fails by chance, kept in the folder
    // that stays, would fail for every later change, which would count as caught.
    command.env("PROPTEST_RNG_SEED", "1").env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1");
    if args.jobs == 1 {
        command.env("CARGO_TARGET_DIR", shell::target_directory()?.join("mutants/build"));
    }
    let status = command.stdout(std::io::stderr()).status().context("cannot start cargo-mutants")?;
    match status.code() {
        Some(0 | 2 | 3) => Ok(()),
        _ => bail!("cargo-mutants failed ({status})"),
    }
}

/// How many changes were caught, lived, ran into the time limit (which is caught, too) or did not compile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts {
    caught: u64,
    missed: u64,
    timeout: u64,
    unviable: u64,
}

impl Counts {
    fn and(&self, other: &Self) -> Self {
        Self {
            caught: self.caught + other.caught,
            missed: self.missed + other.missed,
            timeout: self.timeout + other.timeout,
            unviable: self.unviable + other.unviable,
        }
    }

    /// The counts with their names, for `cargo xtask counts`.
    fn named(&self) -> [(String, u64); 4] {
        [
            ("caught", self.caught),
            ("caught by the time limit", self.timeout),
            ("not caught", self.missed),
            ("do not compile", self.unviable),
        ]
        .map(|(what, count)| (format!("changes: {what}"), count))
    }

    /// Share of the changes that the tests notice; 1 if there are none.
    fn share(&self) -> f64 {
        let noticed = self.caught + self.timeout;
        let all = noticed + self.missed;
        if all == 0 { 1.0 } else { noticed as f64 / all as f64 }
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { caught, missed, timeout, unviable } = self;
        let percent = 100.0 * self.share();
        write!(
            f,
            "{caught} caught, {timeout} timeout, {missed} missed ({percent:.1} % caught); {unviable} do not compile"
        )
    }
}

/// A change that lives.
struct Missed {
    /// Without line and column, so that an edit elsewhere in the file does not invalidate the list.
    key: String,
    line: String,
}

/// The results of the tool for one package.
struct Outcomes {
    counts: Counts,
    missed: Vec<Missed>,
}

impl Outcomes {
    /// Reads what the last pass wrote to `folder`. It lists changes that were tried before as caught, whether they were
    /// or did not compile, so the others are kept in [`keep`].
    fn read(folder: &Path) -> Result<Self> {
        let tried = folder.join("mutants.out");
        let (timeout, unviable) = (lines(&folder.join("timeout.txt")), lines(&folder.join("unviable.txt")));
        let mut caught = lines(&tried.join("caught.txt"));
        caught.extend(lines(&tried.join("previously_caught.txt")));
        caught.retain(|line| !timeout.contains(line) && !unviable.contains(line));
        let path = tried.join("missed.txt");
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let missed: Vec<Missed> = text.lines().map(|line| Missed { key: key(line), line: line.to_owned() }).collect();
        let [caught, timeout, unviable] = [caught, timeout, unviable].map(|lines| lines.len() as u64);
        Ok(Self { counts: Counts { caught, missed: missed.len() as u64, timeout, unviable }, missed })
    }
}

/// Adds the changes of the last pass that ran into the time limit or did not compile to those of earlier passes.
fn keep(folder: &Path, iterate: bool) -> Result<()> {
    for name in ["timeout.txt", "unviable.txt"] {
        let kept = folder.join(name);
        let mut all = if iterate { lines(&kept) } else { BTreeSet::new() };
        all.extend(lines(&folder.join("mutants.out").join(name)));
        let text: String = all.iter().map(|line| format!("{line}\n")).collect();
        fs::write(&kept, text).with_context(|| format!("cannot write {}", kept.display()))?;
    }
    Ok(())
}

/// The lines of a file; none if there is no such file.
fn lines(file: &Path) -> BTreeSet<String> {
    fs::read_to_string(file).unwrap_or_default().lines().map(str::to_owned).collect()
}

/// A line of the tool, `FILE:LINE:COLUMN: CHANGE in FUNCTION`, without line and column.
fn key(line: &str) -> String {
    match line.splitn(4, ':').collect::<Vec<_>>().as_slice() {
        [file, _, _, change] => format!("{file}:{change}"),
        _ => line.to_owned(),
    }
}

/// The listed changes with their reasons.
fn listed() -> Result<BTreeMap<String, String>> {
    let path = shell::root().join(SURVIVORS);
    let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    parse(&text).with_context(|| format!("cannot use {SURVIVORS}"))
}

/// Parses `[[survivor]]` tables of `changes` and one `reason`.
fn parse(text: &str) -> Result<BTreeMap<String, String>> {
    let file: toml::Table = text.parse()?;
    let mut listed = BTreeMap::new();
    for entry in file.get("survivor").and_then(|list| list.as_array()).into_iter().flatten() {
        let reason = entry.get("reason").and_then(|it| it.as_str()).context("a survivor without a reason")?;
        let changes = entry.get("changes").and_then(|it| it.as_array()).context("a survivor without changes")?;
        for change in changes {
            let change = change.as_str().context("a change that is no text")?;
            listed.insert(change.to_owned(), reason.to_owned());
        }
    }
    Ok(listed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listed_change_is_found_wherever_it_has_moved_within_its_file() {
        let line = "model/src/amplifier.rs:51:56: replace > with >= in Amplifier::limited_to";
        assert_eq!(key(line), "model/src/amplifier.rs: replace > with >= in Amplifier::limited_to");
        assert_eq!(key(&line.replace("51:56", "9:1")), key(line));
    }

    #[test]
    fn what_a_change_is_called_matches_itself_alone() {
        let line = "model/src/a.rs:5:9: replace f -> Option<[u8; 2]> with Some([0; 2])";
        assert_eq!(escaped(line), r"model/src/a\.rs:5:9: replace f -> Option<\[u8; 2\]> with Some\(\[0; 2\]\)");
    }

    #[test]
    fn each_survivor_in_the_list_has_a_reason() {
        let listed = listed().unwrap();
        assert!(listed.iter().all(|(change, reason)| change.contains(".rs: ") && reason.len() > 20), "{listed:#?}");
        assert!(parse("[[survivor]]\nchanges = ['a']").is_err());
        assert!(parse("[[survivor]]\nreason = 'a'").is_err());
    }

    #[test]
    fn the_page_shows_every_survivor() {
        let page = fs::read_to_string(shell::root().join("docs/counts.md")).unwrap();
        for change in listed().unwrap().keys() {
            assert!(page.contains(&format!("`{change}`")), "{change}");
        }
    }

    #[test]
    fn a_change_that_runs_into_the_time_limit_counts_as_caught() {
        let counts = Counts { caught: 94, timeout: 1, missed: 5, unviable: 7 };
        assert_eq!(counts.share(), 0.95);
        assert_eq!(Counts::default().share(), 1.0);
    }
}
