//! Builds the MCU's images with cargo and keeps each under a name of its own.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::{seal, shell};

/// Goal of the optimiser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Opt {
    /// Size, as it is flashed
    S,
    /// Speed
    #[value(name = "3")]
    Three,
}

impl Opt {
    /// Every goal.
    pub const ALL: [Self; 2] = [Self::S, Self::Three];

    /// The compiler's `opt-level` for the control tick.
    pub const fn name(self) -> &'static str {
        match self {
            Self::S => "s",
            Self::Three => "3",
        }
    }

    const fn profile(self) -> &'static str {
        match self {
            Self::S => "firmware",
            Self::Three => "firmware-3",
        }
    }
}

/// A board that the firmware runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Board {
    /// NUCLEO-G474RE with an STM32G474RE, which is flashed.
    Nucleo,
    /// MPS2 with image AN386, a Cortex-M4 that QEMU emulates.
    Mps2,
}

impl Board {
    /// Every board.
    pub const ALL: [Self; 2] = [Self::Nucleo, Self::Mps2];

    /// Name of the board, of its binary and of its feature.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nucleo => "nucleo-g474re",
            Self::Mps2 => "mps2-an386",
        }
    }

    /// Package with the binary of the board.
    pub const fn package(self) -> &'static str {
        match self {
            Self::Nucleo => "firmware",
            Self::Mps2 => "test-bench",
        }
    }
}

/// Returns the path of the program `vsj`: the one that the variable `VSJ` names, else one that is built.
pub fn vsj() -> Result<PathBuf> {
    if let Some(built) = env::var_os("VSJ") {
        return Ok(built.into());
    }
    shell::run(shell::cargo().args(["build", "--quiet", "--release", "-p", "host-sim", "--bin", "vsj"]))?;
    Ok(shell::target_directory()?.join("release/vsj"))
}

/// Builds the C library for this machine, or for the MCU as its images are built. Returns its path.
pub fn c_library(for_mcu: bool) -> Result<PathBuf> {
    let mut command = shell::cargo();
    // Alone, so that it is optimised as a whole.
    command.args(["rustc", "--quiet", "-p", "capi", "--lib", "--crate-type", "staticlib"]);
    let folder = if for_mcu {
        command.args(["--profile", Opt::S.profile(), "--target", shell::MCU]);
        format!("{}/{}", shell::MCU, Opt::S.profile())
    } else {
        command.arg("--release");
        "release".to_owned()
    };
    shell::run(&mut command)?;
    Ok(shell::target_directory()?.join(folder).join("libvsj_tick.a"))
}

/// Builds the default image of a board, with the paper's controller and the amplifier of 700 V. Returns the path of its
/// ELF file.
pub fn image(board: Board, opt: Opt) -> Result<PathBuf> {
    image_with(&[], board, opt)
}

/// Builds the image of a board with further features. Returns the path of its ELF file.
pub fn image_with(features: &[&str], board: Board, opt: Opt) -> Result<PathBuf> {
    let features = [&[board.name()], features].concat();
    compile(board.package(), &features.join(","), opt, ["--bin", board.name()], board.name(), &features.join("-"))
}

/// Builds an example of the package `test-bench` with a comma-separated list of features. Returns the path of its ELF
/// file.
pub fn example(name: &str, features: &str, opt: Opt) -> Result<PathBuf> {
    compile(Board::Mps2.package(), features, opt, ["--example", name], &format!("examples/{name}"), name)
}

/// Copies what cargo built to `image/NAME`, an image with its checksum: cargo itself uses one file name for every set of features.
fn compile(package: &str, features: &str, opt: Opt, what: [&str; 2], file: &str, name: &str) -> Result<PathBuf> {
    let folder = shell::target_directory()?.join(shell::MCU).join(opt.profile());
    let images = folder.join("image");
    fs::create_dir_all(&images).with_context(|| format!("cannot make {}", images.display()))?;
    // No other build may take place between building and copying.
    let turn = fs::File::create(folder.join("turn.lock")).context("cannot make a lock")?;
    turn.lock().context("cannot wait for a lock")?;
    shell::run(cargo_build(shell::root(), package, features, opt).args(what))?;
    let (built, own) = (folder.join(file), images.join(name));
    // Replaces the old file instead of overwriting it: an emulator may be running it.
    let new = own.with_extension("new");
    let mut elf = read(&built)?;
    if what[0] == "--bin" {
        seal::seal(&mut elf).with_context(|| format!("in {}", built.display()))?;
    }
    fs::write(&new, elf).with_context(|| format!("cannot write {}", new.display()))?;
    fs::rename(&new, &own).with_context(|| format!("cannot write {}", own.display()))?;
    Ok(own)
}

/// Builds the image of a board from the sources in `root`, which may be a copy, into a target directory of that copy.
/// Returns the path of its ELF file.
pub fn image_of_copy(root: &Path, features: &[&str], board: Board) -> Result<PathBuf> {
    let features = [&[board.name()], features].concat().join(",");
    let target = root.join("target");
    let mut command = cargo_build(root, board.package(), &features, Opt::S);
    shell::run(command.args(["--bin", board.name()]).env("CARGO_TARGET_DIR", &target))?;
    Ok(target.join(shell::MCU).join(Opt::S.profile()).join(board.name()))
}

/// The command that compiles a package for the MCU.
fn cargo_build(root: &Path, package: &str, features: &str, opt: Opt) -> Command {
    let mut command = shell::cargo();
    command.current_dir(root).args(["build", "--quiet", "--package", package]);
    command.args(["--features", features, "--profile", opt.profile(), "--target", shell::MCU]);
    without_paths(&mut command, root);
    command
}

/// Keeps the paths of this machine out of what a command of cargo builds: the sources in `root` are named as if they were in `/vsj`,
/// and those of the registry as if they were in `/cargo`.
pub fn without_paths(command: &mut Command, root: &Path) {
    let remapped = [(root.to_owned(), "/vsj"), (cargo_home(), "/cargo")];
    let flags = remapped.map(|(from, to)| format!("--remap-path-prefix={}={to}", from.display()));
    // Separated as cargo wants it, so that a path may contain spaces.
    command.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\x1f"));
}

/// The folder in which cargo keeps the sources of dependencies.
fn cargo_home() -> PathBuf {
    let home = || std::env::home_dir().unwrap_or_default().join(".cargo");
    std::env::var_os("CARGO_HOME").map_or_else(home, PathBuf::from)
}

/// Reads a file. The error names it.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}
