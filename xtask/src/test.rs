//! `cargo xtask test`: every check and test, in order.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

use anyhow::{Context, Result};
use xtask::{setup, shell};

use crate::page;
use crate::steps::{self, Lanes, Progress, Step};

/// What a slip of the hand breaks.
const FIRST: &[Step] = &[Step::new("format", &["fmt", "--all", "--check"])];

/// Every other step. All of the host's programs and tests are built by one command: built for one package, what they share would have
/// other features and be built again. Without a board the firmware's library is an ordinary one.
///
/// Each image is linted for its board alone, with and without the optional features, because an image with a feature hides what is left
/// out without it. Of the six images `boot` runs the first and, where that matters, one that differs from it in everything.
const LANES: Lanes = Lanes {
    build: Step::new("build", &BUILD),
    // The longest step by far, and on one core most of the time: it begins as soon as it can.
    host: &[
        // The same random cases in every run, so that it judges the change alone; `cargo test` by itself draws new ones.
        Step::new("test", &["test", "--workspace", WITHOUT_PYTHON]).with("PROPTEST_RNG_SEED", "1"),
    ],
    beside: &[
        Step::new("lint nucleo", &lint("-pfirmware", "nucleo-g474re")),
        Step::new("all nucleo", &lint("-pfirmware", "nucleo-g474re,fast,robust,adaptation,kilovolt")),
        Step::new("lint mps2", &lint("-ptest-bench", "mps2-an386")),
        Step::new("all mps2", &lint("-ptest-bench", "mps2-an386,fast,robust,adaptation,kilovolt")),
        Step::xtask("prove", &["prove", "--ticks", "1000000"]),
        // Of the page only this is compiled here: what is left out for a browser must not be missed there.
        Step::new("lint page", &["clippy", "--quiet", "-ppage", "--lib", "--target", page::WASM, "--", "-Dwarnings"]),
        Step::new("lint host", &["clippy", "--workspace", "--all-targets", "--", "-Dwarnings"]),
        Step::new("document", &["doc", "--no-deps", "--workspace"]).with("RUSTDOCFLAGS", "-Dwarnings"),
        // In the profile of `build`: of its dependencies it takes those with the same features.
        Step::xtask("package", &["python", "--only", "install", "--profile", "dev"]),
    ],
    built: &[
        Step::new(
            "publish",
            &[
                "package",
                "--quiet",
                "--offline",
                "--allow-dirty",
                "--target-dir",
                PACKAGED,
                "-pvsj-model",
                "-pvsj-link",
            ],
        ),
        Step::xtask("python", &["python", "--only", "test"]),
        // The long ones first, as both lanes share what is left at the end.
        Step::emulation("firmware", &["proof"]),
        Step::emulation("story", &["story", "--check"]),
        // Of the images with 16 KB of RAM the one that needs most.
        Step::emulation("size", &["size", "--feedback", "--controller", "fast", "--limit-v", "1000"]),
        Step::emulation("boot", &["boot"]),
        Step::emulation("boot both", &["boot", "--brief", "--controller", "fast", "--limit-v", "1000"]),
        Step::emulation("clients", &["clients"]),
        Step::emulation("c library", &["capi"]),
    ],
};

/// Before a release as well: what needs further images and would take the whole beyond 20 minutes.
const LONG: &[Step] = &[
    // Bounds on what the bank adds to the tick, and each controller for each kind of spring.
    Step::emulation("cost bank", &["emulate", "--isolation"]),
    Step::emulation("cost ticks", &["emulate", "--blocks"]),
    Step::emulation("boot all", &["boot", "--all"]),
    // The images that need most of each controller's and the bank's memory.
    Step::emulation("size robust", &["size", "--controller", "robust", "--limit-v", "1000"]),
    Step::emulation("size both", &["size", "--adaptation"]),
];

/// The Python package has no tests in Rust, and for an interpreter `package` would build its bindings again.
const WITHOUT_PYTHON: &str = "--exclude=vsj-python";

#[rustfmt::skip]
const BUILD: [&str; 8] =
    ["build", "--quiet", "--workspace", WITHOUT_PYTHON, "--lib", "--bins", "--tests", "--examples"];

#[rustfmt::skip]
const fn lint(package: &'static str, features: &'static str) -> [&'static str; 13] {
    ["clippy", package, "--lib", "--bins", "--examples", "--profile", "firmware", "--target", shell::MCU,
     "--features", features, "--", "-Dwarnings"]
}

/// The steps for `--help`.
pub(crate) fn help() -> String {
    let Lanes { build, host, beside, built } = LANES;
    format!(
        "Steps; the first that fails ends the run:\n  setup      cargo xtask setup\n{}\nthen\n{}{}\nand, beside these,\n{}{}\nWith --long also\n{}",
        steps::help(FIRST),
        steps::help(&[build]),
        steps::help(host),
        steps::help(beside),
        steps::help(built),
        steps::help(LONG)
    )
}

/// Packages that could be published, and the folder in which they are packaged and built.
const PACKAGES: [&str; 2] = ["vsj-model", "vsj-link"];
const PACKAGED: &str = "target/publish";

/// Removes the packages of an earlier run, which cargo would take for this run's: a released version never changes.
fn forget_packages() -> Result<()> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| Some(env::home_dir()?.join(".cargo")));
    let sources = home.context("no home directory")?.join("registry/src");
    let registries: Vec<PathBuf> =
        fs::read_dir(sources).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path())).collect();
    let version = env!("CARGO_PKG_VERSION");
    let copies = registries.iter().flat_map(|registry| PACKAGES.map(|name| registry.join(format!("{name}-{version}"))));
    copies.chain([Path::new(PACKAGED).to_owned()]).try_for_each(|folder| match fs::remove_dir_all(&folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot remove {}", folder.display()))
        }
        _ => Ok(()),
    })
}

/// Arguments of `cargo xtask test`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Also what is verified only before a release, because it takes long
    #[arg(long)]
    long: bool,
}

/// Runs every step; an error names the first that fails.
pub(crate) fn run(args: &Args) -> Result<()> {
    let long = if args.long { LONG } else { &[] };
    let progress = Progress::of(1 + FIRST.len() + LANES.count() + long.len());
    progress.begin("setup");
    setup::run()?;
    setup::target(page::WASM)?;
    forget_packages()?;
    for step in FIRST {
        progress.begin(step.name);
        step.run()?;
    }
    LANES.run(&progress)?;
    for step in long {
        progress.begin(step.name);
        step.run()?;
    }
    progress.end();
    Ok(())
}
