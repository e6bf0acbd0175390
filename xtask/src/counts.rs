//! `cargo xtask counts`: how much the tests and commands have tried, each count with its date and commit.
//!
//! In: what the commands have left in `target/counts/`. Out: a table on stdout; what has not run is printed as "not run".
//! A command that finds a violation fails, and leaves no counts.

use anyhow::{Context, Result};
use xtask::shell;
use xtask::tally::Tally;

/// Where counts come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// A command, by the name of its tally; its own run writes it.
    Command(&'static str, &'static str),
    /// A test, by the name of its tally and the arguments of cargo. It prints lines `count: NUMBER WHAT`.
    Test(&'static str, &'static [&'static str]),
}

use Source::{Command, Test};

/// Everything that is counted, by what it shows.
const SECTIONS: [(&str, &[Source]); 7] = [
    (
        "inputs tried",
        &[
            Test("formats", &["test", "--release", "-p", "end-to-end", "--test", "fuzz"]),
            Test("hostile", &["test", "--release", "-p", "end-to-end", "--test", "hostile"]),
            Command("fuzz", "cargo xtask fuzz"),
            Test("frames", &["test", "-p", "vsj-link", "--test", "damaged"]),
        ],
    ),
    ("pairs of state and event", &[Test("pairs", &["test", "-p", "vsj-model", "--lib", "every_state_and_event"])]),
    (
        "faults injected",
        &[
            Command("drill", "cargo xtask drill"),
            Command("boot", "cargo xtask boot"),
            Command("boot-fast-kilovolt", "cargo xtask boot --controller fast --limit-v 1000"),
        ],
    ),
    (
        "changes of the code",
        &[
            Command("mutants-model", "cargo xtask mutants --package model"),
            Command("mutants-link", "cargo xtask mutants --package link"),
            Command("mutants-firmware", "cargo xtask mutants --package firmware"),
            Command("sabotage", "cargo xtask sabotage"),
            Command("sabotage-host", "cargo xtask sabotage --host"),
        ],
    ),
    (
        "ticks without a violation",
        &[Command("soak", "cargo xtask soak"), Command("soak-emulated", "cargo xtask soak --emulated")],
    ),
    (
        "checks without a finding",
        &[
            Command("sanitize-miri", "cargo xtask sanitize --only miri"),
            Command("sanitize-address", "cargo xtask sanitize --only address"),
            Command("deny", "cargo xtask deny"),
            Command("reproducible", "cargo xtask reproducible"),
        ],
    ),
    (
        "nothing lost",
        &[Test("power-cuts", &["test", "-p", "firmware", "--lib", "a_power_cut"]), Command("talk", "cargo xtask talk")],
    ),
];

/// Arguments of `cargo xtask counts`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Run the tests that count before: formats, hostile, frames, pairs, power-cuts; all of them without a name
    #[arg(long, value_name = "TEST", num_args = 0.., value_parser = tests().map(|(name, _)| name).collect::<Vec<_>>())]
    run: Option<Vec<String>>,
}

/// Runs the chosen tests, and prints all counts.
pub(crate) fn run(args: &Args) -> Result<()> {
    for (name, cargo) in tests() {
        if args.run.as_ref().is_some_and(|chosen| chosen.is_empty() || chosen.iter().any(|it| it == name)) {
            eprintln!("$ cargo {}", cargo.join(" "));
            let output = shell::output(shell::cargo().args(cargo).args(["--", "--nocapture"]))?;
            let counts = counts(&output);
            anyhow::ensure!(!counts.is_empty(), "`cargo {}` has counted nothing", cargo.join(" "));
            Tally::now(counts)?.write(name)?;
        }
    }
    for (section, sources) in SECTIONS {
        println!("{section}");
        for source in sources {
            let (name, line) = match source {
                Command(name, line) => (name, (*line).to_owned()),
                Test(name, cargo) => (name, format!("cargo {}", cargo.join(" "))),
            };
            print!("{}", table(&line, Tally::read(name).with_context(|| line.clone())?.as_ref()));
        }
    }
    Ok(())
}

/// Names and arguments of the tests that count.
fn tests() -> impl Iterator<Item = (&'static str, &'static [&'static str])> {
    SECTIONS.into_iter().flat_map(|(_, sources)| sources).filter_map(|source| match source {
        Test(name, cargo) => Some((*name, *cargo)),
        Command(..) => None,
    })
}

/// The lines of one command: where and when it ran, and its counts.
fn table(command: &str, tally: Option<&Tally>) -> String {
    let Some(Tally { date, commit, counts }) = tally else { return format!("  {command}: not run\n") };
    let rows = counts.iter().map(|(what, count)| format!("{count:>14}  {what}\n"));
    [format!("  {command}: {date}, {commit}\n")].into_iter().chain(rows).collect()
}

/// The counts in the output of a test, sorted by their names: tests run at the same time.
fn counts(output: &str) -> Vec<(String, u64)> {
    let parsed = output.lines().filter_map(|line| {
        let (count, what) = line.split_once("count: ")?.1.split_once(' ')?;
        Some((what.to_owned(), count.parse().ok()?))
    });
    let mut counts: Vec<_> = parsed.collect();
    counts.sort();
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_read_wherever_they_are_in_a_line() {
        let output = "running 2 tests\ntest b ... count: 12 inputs of b\nok\ncount: 3 inputs of a\ncount: no number\n";
        assert_eq!(counts(output), [("inputs of a".to_owned(), 3), ("inputs of b".to_owned(), 12)]);
    }

    #[test]
    fn what_has_not_run_is_said() {
        assert_eq!(table("cargo xtask soak", None), "  cargo xtask soak: not run\n");
        let tally = Tally { date: "2026-01-31".into(), commit: "abc".into(), counts: vec![("ticks".into(), 7)] };
        assert_eq!(table("soak", Some(&tally)), "  soak: 2026-01-31, abc\n             7  ticks\n");
    }

    #[test]
    fn the_page_shows_every_command_that_counts() {
        let page = std::fs::read_to_string(shell::root().join("docs/counts.md")).unwrap();
        for (_, sources) in SECTIONS {
            for source in sources {
                let line = match source {
                    Command(_, line) => (*line).to_owned(),
                    Test(_, cargo) => format!("cargo {}", cargo.join(" ")),
                };
                assert!(page.contains(&format!("  {line}: ")), "{line}");
            }
        }
    }
}
