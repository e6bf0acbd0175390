//! `cargo xtask`: the project's commands. What runs or reads the firmware's images is in the package `emulation`, which
//! this binary starts.

mod bench;
mod bench_fleet;
mod bench_records;
mod check;
mod counts;
mod deny;
mod dist;
mod emulation;
mod flash;
mod fuzz;
mod image;
mod manual;
mod mutants;
mod nightly;
mod package;
mod page;
mod prove;
mod reproducible;
mod sabotage;
mod sanitize;
mod sbom;
mod steps;
mod test;
mod times;
#[cfg(test)]
mod unsafe_code;

use std::convert::Infallible;
use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::Result;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use xtask::setup;
use xtask::variant::Variant;

use emulation::Forwarded;

/// The project's commands.
#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    after_help = "\
Examples:
  cargo xtask setup            make a fresh machine ready
  cargo xtask check            after every edit: format, lints, unit tests
  cargo xtask test             everything that must pass before a change goes in
  cargo xtask emulate          the firmware on the report's stair, under QEMU
  cargo xtask image            the MCU's images: ELF, bin, hex; --controller fast, --limit-v 1000 for others
  cargo xtask boot             that image on register models: safe at boot and after a fault?
  cargo xtask fuzz             every file format and frame, a minute each
  cargo xtask bench --json     speed compared with Python, as JSON

Exit codes: 0 success, 1 the work failed, 2 bad arguments."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// Commands with [`Forwarded`] arguments are defined in the package `emulation`, under the same names.
#[derive(Subcommand)]
enum Command {
    /// Install what a fresh machine lacks
    ///
    /// Reads rust-toolchain.toml and has rustup add a missing toolchain, component or target; installs QEMU with
    /// apt-get, and waits while another apt-get runs.
    ///
    /// Harmless when repeated; needs the network only if something is missing.
    #[command(verbatim_doc_comment)]
    Setup,
    /// Format, lints and unit tests: after every edit
    Check,
    /// Setup, then every check and test
    Test(test::Args),
    /// Run the firmware on the report's stair under QEMU
    Emulate(Forwarded),
    /// Everything that the emulated firmware must show
    Proof(Forwarded),
    /// Run the fault drills under QEMU
    Drill(Forwarded),
    /// Let a host talk to the emulated firmware
    Talk(Forwarded),
    /// Let the clients in C++ and Python command the emulated firmware
    Clients(Forwarded),
    /// End-to-end demonstration: run, diagnose, extend, run again
    Story(Forwarded),
    /// Write the image to the real board and show its log (probe-rs)
    ///
    /// The log's first line names the controller, a second one an amplifier of 1000 V. A stored model stays; one
    /// that the controller cannot run is a fault until another is sent. Needs `cargo install probe-rs-tools --locked`, and
    /// on Linux the udev rules of https://probe.rs/docs/getting-started/probe-setup/
    #[command(
        verbatim_doc_comment,
        after_help = "\
Examples:
  cargo xtask flash
  cargo xtask flash --controller fast                  as fast as the amplifier allows
  cargo xtask flash --controller fast --limit-v 1000   with an amplifier of 1000 V
  cargo xtask flash --controller robust                for a spring known to within errors"
    )]
    Flash(Variant),
    /// Flash, RAM and worst stack of each image
    Size(Forwarded),
    /// Make the MCU's images: ELF, bin, hex and bill of materials (CycloneDX)
    ///
    /// Prints their paths; each image has a name of its own.
    #[command(after_help = "\
Examples:
  cargo xtask image                                    nucleo-g474re, mps2-an386
  cargo xtask image --board mps2-an386                 the emulated board's alone
  cargo xtask image --controller fast                  nucleo-g474re-fast, mps2-an386-fast
  cargo xtask image --controller fast --limit-v 1000   nucleo-g474re-fast-kilovolt, mps2-an386-fast-kilovolt")]
    Image(image::Args),
    /// Run the image that is flashed on models of the STM32G474's registers
    Boot(Forwarded),
    /// Run random ticks on the host and check every invariant in each
    Soak(Forwarded),
    /// Build the C library's example, run it here and under QEMU
    Capi(Forwarded),
    /// Compare the host's speed with Python's
    ///
    /// closed-loop: the report's loop, 70 s at 1 kHz, in scipy, numba, C and Rust, in turns.
    /// records: CPU time of identifications and diagnoses, and of SciPy's output-error fits of the same records.
    /// fleet: time of `python -m vsj.fleet` with one worker and with two.
    ///
    /// What is beyond its bound is marked and is no error. Takes half an hour on a quiet machine.
    #[command(
        verbatim_doc_comment,
        after_help = "\
Examples:
  cargo xtask bench --only fleet --fleet-records 400
  cargo xtask bench --json | jq '.rows[] | {name, to_rival, met}'"
    )]
    Bench(bench::Args),
    /// Install the Python package in a virtual environment and run its tests
    Python(package::Args),
    /// Build the documents as a book, with a page for each command
    ///
    /// Into target/manual/book; prints the path of its first page. Installs mdbook under the target directory unless it is
    /// there.
    #[command(verbatim_doc_comment)]
    Manual,
    /// Build the page to try the product in a browser, in target/site
    ///
    /// WebAssembly of the controller and the diagnosis, inlined, so that target/site/index.html also opens from a disk. Fails if the
    /// page is larger than 2 MB, compressed.
    #[command(
        verbatim_doc_comment,
        after_help = "Examples:\n  cargo xtask page\n  cargo xtask page --test            and compare it with vsj, in headless Chromium"
    )]
    Page(page::Args),
    /// Change the code in one place at a time; count what no test notices
    ///
    /// Over model, link and the parts of the firmware that a host can run. Fails below 95 % caught, or if a change lives
    /// that is not in .cargo/mutants-survivors.toml with its reason. Takes hours; installs cargo-mutants under the target
    /// directory unless it is there.
    #[command(
        verbatim_doc_comment,
        after_help = "\
Examples:
  cargo xtask mutants --jobs 4
  cargo xtask mutants --package model --file 'model/src/extended/*'
  cargo xtask mutants --package model --every 20       a sample
  cargo xtask mutants --package model --iterate        only what the last run has not caught"
    )]
    Mutants(mutants::Args),
    /// Break each promise on purpose; demand that its test fails
    ///
    /// As .cargo/sabotages.toml says, in a copy of the sources: each change must
    /// make the test, drill or boot run fail that stands beside the promise in
    /// docs/promises.md. Takes an hour; the copy stays in target/sabotage.
    #[command(
        verbatim_doc_comment,
        after_help = "\
Examples:
  cargo xtask sabotage
  cargo xtask sabotage --host                          no drills, no boot runs
  cargo xtask sabotage --only supervisor --only drill"
    )]
    Sabotage(sabotage::Args),
    /// Run the tests of the MCU's code under Miri and the address sanitizer
    ///
    /// Overflow checks are on in both. Installs a nightly toolchain with Miri unless it is there.
    #[command(verbatim_doc_comment)]
    Sanitize(sanitize::Args),
    /// Check licences, duplicates, sources and advisories of all dependencies
    ///
    /// As deny.toml says. Installs cargo-deny under the target directory unless it is there.
    /// The advisories need RustSec's database from GitHub; without it the rest is checked, and what is missing is said.
    #[command(verbatim_doc_comment)]
    Deny {
        /// Fail if the database of advisories cannot be had
        #[arg(long)]
        require_advisories: bool,
    },
    /// Print how much the tests and commands have tried
    ///
    /// Inputs, pairs of state and event, injected faults, changes of the code, ticks; each with date and commit of its last
    /// run in this folder, or "not run".
    #[command(
        verbatim_doc_comment,
        after_help = "\
Examples:
  cargo xtask counts
  cargo xtask counts --run                             the tests that count as well, in minutes
  cargo xtask counts --run pairs power-cuts"
    )]
    Counts(counts::Args),
    /// Pack a release: vsj, images, documents, licences, checksums
    ///
    /// Into a folder and an archive in target/releases/: `vsj` for this machine with manual pages and completions, the libraries for
    /// FMI and C, the images of both boards for each controller and amplifier with their bills of materials, the manual, the page for a
    /// browser, the changes of this version, the licences of all dependencies, SHA256SUMS.
    #[command(
        verbatim_doc_comment,
        after_help = "\
Example:
  cargo xtask dist
  cd target/releases/vsj-*/ && sha256sum --check SHA256SUMS"
    )]
    Dist,
    /// Prove by an SMT solver what holds for every setting, state and input of the plain tick
    ///
    /// No overflow, codes and voltages in range, slew kept, the estimator's state within the range: one inductive step over the
    /// tick in model/proof/tick.py, which is compared with the one in Rust on random settings and targets. Installs the solver
    /// (z3) in a virtual environment.
    #[command(
        verbatim_doc_comment,
        after_help = "\
Examples:
  cargo xtask prove
  cargo xtask prove --verbose --ticks 1000000"
    )]
    Prove(prove::Args),
    /// Build the images in two folders and compare every byte
    #[command(after_help = "\
Examples:
  cargo xtask reproducible
  cargo xtask reproducible --controller fast --limit-v 1000")]
    Reproducible(Variant),
    /// Fuzz every file format and frame, with sanitizers, on a nightly compiler
    ///
    /// Installs the compiler and cargo-fuzz if they are missing. The properties are in tests/src/fuzz/, the corpora in
    /// fuzz/corpus/; `cargo xtask test` checks a share of both. Prints inputs and edges for each format; a finding is an
    /// error, and its input is in fuzz/artifacts/.
    #[command(
        verbatim_doc_comment,
        after_help = "Examples:\n  cargo xtask fuzz                       each format for a minute\n  cargo xtask fuzz csv elf --seconds 600"
    )]
    Fuzz(fuzz::Args),
    /// Measure how long a build takes: first result, xtask, check
    #[command(after_help = times::EXAMPLES)]
    Times(times::Args),
}

fn main() -> ExitCode {
    let args = arguments();
    let command = Cli::command()
        .mut_subcommand("check", |check| check.after_help(check::help()))
        .mut_subcommand("test", |test| test.after_help(test::help()));
    let cli = match Cli::from_arg_matches(&command.get_matches_from(&args)) {
        Ok(cli) => cli,
        Err(error) => error.exit(),
    };
    match run(cli.command, &args[1..]) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The arguments of this process, `help COMMAND` written as `COMMAND --help`, so that the emulation's commands print
/// their own.
fn arguments() -> Vec<OsString> {
    let mut args: Vec<OsString> = std::env::args_os().collect();
    if args.len() == 3 && args[1] == "help" {
        args[1] = "--help".into();
        args.swap(1, 2);
    }
    args
}

/// Runs a command. `args` are the command line, for the commands of the emulation.
fn run(command: Command, args: &[OsString]) -> Result<()> {
    use Command::{
        Bench, Boot, Capi, Check, Clients, Counts, Deny, Dist, Drill, Emulate, Flash, Fuzz, Image, Mutants, Page, Proof,
    };
    use Command::{
        Manual, Prove, Python, Reproducible, Sabotage, Sanitize, Setup, Size, Soak, Story, Talk, Test, Times,
    };
    match command {
        Setup => setup::run(),
        Check => check::run(),
        Test(args) => test::run(&args),
        Flash(variant) => flash::run(variant),
        Image(args) => image::run(args),
        Bench(args) => bench::run(&args),
        Fuzz(args) => fuzz::run(&args),
        Python(args) => package::run(&args),
        Manual => manual::run(),
        Page(args) => page::run(&args),
        Prove(args) => prove::run(&args),
        Counts(args) => counts::run(&args),
        Dist => dist::run(),
        Times(args) => times::run(&args),
        Mutants(args) => mutants::run(&args),
        Sabotage(args) => sabotage::run(&args),
        Sanitize(args) => sanitize::run(&args),
        Deny { require_advisories } => deny::run(require_advisories),
        Reproducible(variant) => reproducible::run(variant),
        Emulate(_) | Proof(_) | Drill(_) | Talk(_) | Clients(_) | Story(_) | Size(_) | Boot(_) | Capi(_) | Soak(_) => {
            emulation::replace(args).map(|never: Infallible| match never {})
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::error::ErrorKind;
    use xtask::{documents, shell};

    use super::*;

    #[test]
    fn the_command_line_is_defined_without_contradictions() {
        Cli::command().debug_assert();
    }

    /// The options of the emulation's commands are checked by a test of that package.
    #[test]
    fn the_documents_name_commands_that_exist() {
        let lines = documents::lines().unwrap();
        let mut tried = 0;
        for line in &lines {
            let Some(arguments) = line.arguments("cargo xtask").filter(|arguments| !arguments.is_empty()) else {
                continue;
            };
            if let Err(error) = Cli::try_parse_from(["cargo xtask"].into_iter().chain(arguments)) {
                assert_eq!(error.kind(), ErrorKind::DisplayHelp, "{line:?}: {error}");
            }
            tried += 1;
        }
        assert!(tried > 80, "{tried} command lines");
    }

    #[test]
    fn the_documents_name_packages_tests_and_examples_that_exist() {
        let metadata =
            shell::json(shell::cargo().args(["metadata", "--no-deps", "--offline", "--format-version", "1"]));
        let packages = metadata.unwrap()["packages"].take();
        let mut tried = 0;
        for line in documents::lines().unwrap() {
            let mut words = line.text.split_whitespace().skip_while(|word| *word != "cargo").skip(1);
            let is_of_package = ["run", "test", "build", "rustc", "publish", "package"];
            if !words.next().is_some_and(|command| is_of_package.contains(&command)) {
                continue;
            }
            let options: Vec<&str> = words.take_while(|word| *word != "--").collect();
            for pair in options.windows(2) {
                let [option, name] = pair else { continue };
                let is_there = match *option {
                    "-p" => packages.as_array().unwrap().iter().any(|package| package["name"] == *name),
                    "--test" | "--example" => packages.as_array().unwrap().iter().any(|package| {
                        let is_named = |target: &serde_json::Value| {
                            target["name"] == *name && target["kind"][0] == option.trim_start_matches('-')
                        };
                        package["targets"].as_array().unwrap().iter().any(is_named)
                            && options.windows(2).any(|of| of[0] == "-p" && package["name"] == of[1])
                    }),
                    _ => continue,
                };
                assert!(is_there, "{option} {name} does not exist: {line:?}");
                tried += 1;
            }
        }
        assert!(tried > 15, "{tried} names");
    }

    #[test]
    fn options_of_the_emulation_are_handed_on_unparsed() {
        for line in
            ["emulate --json --opt 3", "story --effect hysteresis gain-error", "size --help", "boot -h", "talk x"]
        {
            let words = ["cargo xtask"].into_iter().chain(line.split(' '));
            assert!(Cli::try_parse_from(words).is_ok(), "{line}");
        }
    }
}
