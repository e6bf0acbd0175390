//! `cargo xtask clients`: the clients of the link in C++ and Python and the full screen of `vsj watch` command the emulated firmware.
//!
//! In: the image and the virtual environment of `cargo xtask python`, in which the package is installed. Out: one line on stdout for
//! each client.

use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use xtask::build::{self, Board, Opt};
use xtask::{setup, shell};

use crate::binary::size;
use crate::qemu::emulator;
use crate::watch;

/// Longest wait for the emulator's socket.
const PATIENCE: Duration = Duration::from_secs(10);
/// Variables that name the board, and the one with an isolation bank, to the tests of the Python package.
const PYTHON_BOARD: &str = "VSJ_BOARD";
const PYTHON_BANK: &str = "VSJ_BOARD_WITH_BANK";
/// Folder of the C++ client and its tests.
const CPP: &str = "clients/cpp";

/// Builds the image and the C++ programs, and lets each client command a board of its own.
pub(crate) fn run() -> Result<()> {
    setup::emulator()?;
    setup::cxx()?;
    let cmake = setup::cmake()?;
    let elf = build::image(Board::Mps2, Opt::S)?;
    let with_bank = build::image_with(size::ISOLATION, Board::Mps2, Opt::S)?;
    let target = shell::target_directory()?;
    let vsj = build::vsj()?;
    cpp(&cmake, &elf, &with_bank, &target)?;
    python(&vsj, &elf, PYTHON_BOARD, &target)?;
    python(&vsj, &with_bank, PYTHON_BANK, &target)?;
    watch::run(&vsj, &elf).context("vsj watch --emulated")
}

/// Compiles the header with CMake, and runs its tests: every frame of the protocol, an MCU that does what no healthy board does, then the
/// board without and with an isolation bank.
fn cpp(cmake: &Path, elf: &Path, with_bank: &Path, target: &Path) -> Result<()> {
    let built = target.join("clients-cpp");
    let source = shell::root().join(CPP);
    shell::run(shell::command(cmake).arg("-S").arg(&source).arg("-B").arg(&built).arg("-DCMAKE_BUILD_TYPE=Debug"))?;
    shell::run(shell::command(cmake).arg("--build").arg(&built).args(["--parallel", "2"]))?;
    shell::run(shell::command(built.join("frames")).arg(source.join("golden")))?;
    shell::run(&mut shell::command(built.join("host")))?;
    let folder = tempfile::tempdir()?;
    on_board(elf, "cpp", |port| {
        let mut command = shell::command(built.join("board"));
        command.arg(port).arg(folder.path().join("record.csv"));
        command
    })?;
    on_board(with_bank, "cpp", |port| {
        let mut command = shell::command(built.join("isolation"));
        command.arg(port);
        command
    })?;
    // The manual's first step.
    on_board(elf, "cpp", |port| {
        let mut command = shell::command(built.join("step"));
        command.arg(port);
        command
    })
}

/// Runs the tests of the Python package that need a board, whose port they read from `variable`.
fn python(vsj: &Path, elf: &Path, variable: &str, target: &Path) -> Result<()> {
    let python = target.join("python-venv/bin/python");
    ensure!(python.exists(), "{} is missing: run cargo xtask python", python.display());
    on_board(elf, "python", |port| {
        let mut command = shell::command(&python);
        command.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "python/tests/test_link.py"]);
        command.env("VSJ", vsj).env(variable, port);
        command
    })
}

/// Starts a board and runs the command of its port.
fn on_board(elf: &Path, name: &str, command: impl FnOnce(&str) -> Command) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let socket = folder.path().join("link");
    let port = format!("unix:{}", socket.display());
    // What it stores ends with the folder.
    let run = || {
        let begin = Instant::now();
        while !socket.exists() {
            ensure!(begin.elapsed() < PATIENCE, "the emulator has not opened {}", socket.display());
            thread::sleep(Duration::from_millis(10));
        }
        shell::run(&mut command(&port))
    };
    emulator::obey_in(folder.path(), elf, &socket, |_| {}, run).with_context(|| format!("the client in {name}"))?;
    Ok(())
}
