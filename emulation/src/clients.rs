//! `cargo xtask clients`: the clients of the link in C++ and Python and the full screen of `vsj watch` command the emulated firmware.
//!
//! In: the image and the virtual environment of `cargo xtask python`, in which the package is installed. Out: one line on stdout for
//! each client.

use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde_json::Value;
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
/// A spring whose model is sent.
const PLANT: &str = "docs/plant.toml";

/// Builds the image and the C++ programs, and lets each client command a board of its own.
pub(crate) fn run() -> Result<()> {
    setup::emulator()?;
    setup::cxx()?;
    let cmake = setup::cmake()?;
    let elf = build::image(Board::Mps2, Opt::S)?;
    let with_bank = build::image_with(size::ISOLATION, Board::Mps2, Opt::S)?;
    let target = shell::target_directory()?;
    let vsj = build::vsj()?;
    cpp(&cmake, &vsj, &elf, &with_bank, &target)?;
    python(&vsj, &elf, PYTHON_BOARD, &target)?;
    python(&vsj, &with_bank, PYTHON_BANK, &target)?;
    watch::run(&vsj, &elf).context("vsj watch --emulated")
}

/// Compiles the header with CMake, and runs its tests: every frame of the protocol, an MCU that does what no healthy board does, then the
/// board without and with an isolation bank.
fn cpp(cmake: &Path, vsj: &Path, elf: &Path, with_bank: &Path, target: &Path) -> Result<()> {
    let built = target.join("clients-cpp");
    let source = shell::root().join(CPP);
    shell::run(shell::command(cmake).arg("-S").arg(&source).arg("-B").arg(&built).arg("-DCMAKE_BUILD_TYPE=Debug"))?;
    shell::run(shell::command(cmake).arg("--build").arg(&built).args(["--parallel", "2"]))?;
    shell::run(shell::command(built.join("frames")).arg(source.join("golden")))?;
    shell::run(&mut shell::command(built.join("host")))?;
    let folder = tempfile::tempdir()?;
    shell::output(shell::command(vsj).args(["export", "model", "--plant", PLANT, "--out"]).arg(folder.path()))?;
    on_board(elf, "cpp", |port| {
        let mut command = shell::command(built.join("board"));
        command.arg(port).args([folder.path().join("record.csv"), folder.path().join("model.bin")]);
        shell::run(&mut command)?;
        let model = |file: &[&str]| -> Result<Value> {
            let mut command = shell::command(vsj);
            shell::json(command.args(["link", port, "--timeout", "10", "--json", "model"]).args(file))
        };
        let sent = |models: &Value| ["format", "length", "checksum"].map(|key| models["active"][key].clone());
        let (by_client, by_command) = (model(&[])?, model(&[PLANT])?);
        let is_new = by_command["active"]["number"] != by_client["active"]["number"];
        ensure!(is_new && sent(&by_client) == sent(&by_command), "{by_client} runs instead of {by_command}");
        Ok(())
    })?;
    on_board(with_bank, "cpp", |port| shell::run(shell::command(built.join("isolation")).arg(port)))?;
    // The manual's first step.
    on_board(elf, "cpp", |port| shell::run(shell::command(built.join("step")).arg(port)))
}

/// Runs the tests of the Python package that need a board, whose port they read from `variable`.
fn python(vsj: &Path, elf: &Path, variable: &str, target: &Path) -> Result<()> {
    let python = target.join("python-venv/bin/python");
    ensure!(python.exists(), "{} is missing: run cargo xtask python", python.display());
    on_board(elf, "python", |port| {
        let mut command = shell::command(&python);
        command.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "python/tests/test_link.py"]);
        shell::run(command.env("VSJ", vsj).env(variable, port))
    })
}

/// Starts a board and does `work` with its port.
fn on_board(elf: &Path, name: &str, work: impl FnOnce(&str) -> Result<()>) -> Result<()> {
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
        work(&port)
    };
    emulator::obey_in(folder.path(), elf, &socket, |_| {}, run).with_context(|| format!("the client in {name}"))?;
    Ok(())
}
