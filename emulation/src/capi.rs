//! `cargo xtask capi`: the example of the C library, built as a user builds it.
//!
//! In: springs and options. Out: a line for each on stdout; an error unless the digest of every DAC code and every estimate is the
//! same in Rust, in C on this machine and in C on an emulated Cortex-M4.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use host_sim::qemu;
use simulation::control_loop::{ControlLoop, Controller, Options};
use simulation::plant_file;
use test_bench::blocks;
use test_bench::digest::Digest;
use xtask::{build, setup, shell};

use crate::binary::audit;
use crate::qemu::emulator::{TIMEOUT, finish};

/// The plain spring and one with every block, each with other controllers.
const CASES: [(&str, Controller); 3] =
    [("paper", Controller::Paper), ("docs/plant.toml", Controller::Fast), ("docs/plant.toml", Controller::Robust)];

/// Builds and runs the example for each case.
pub(crate) fn run() -> Result<()> {
    setup::emulator()?;
    setup::arm_gcc()?;
    let cmake = setup::cmake()?;
    let vsj = build::vsj()?;
    let (library, library_of_mcu) = (build::c_library(false)?, build::c_library(true)?);
    for (plant, controller) in CASES {
        let folder = tempfile::tempdir()?;
        let mut export = shell::command(&vsj);
        export.args(["export", "c", "--plant", plant, "--controller", controller.name(), "--out"]).arg(folder.path());
        shell::output(&mut export)?;
        let here = built(&cmake, folder.path(), "build", &library, &[])?;
        let there =
            built(&cmake, folder.path(), "build-mcu", &library_of_mcu, &["--toolchain", "arm-none-eabi.cmake"])?;
        let mut emulated = Command::new(qemu::PROGRAM);
        emulated.args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "null"]);
        emulated.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(&there);
        let rust = format!("digest {:016x}", in_rust(plant, controller)?);
        for (where_from, mut program) in [("this machine", Command::new(here)), ("the Cortex-M4", emulated)] {
            // QEMU writes the lines of semihosting to stderr.
            let output = finish(&mut program, TIMEOUT).with_context(|| format!("the example on {where_from}"))?;
            let text = [output.stdout, output.stderr].concat();
            let text = String::from_utf8_lossy(&text).trim().to_owned();
            ensure!(output.status.success(), "the example on {where_from} has failed ({}): {text}", output.status);
            ensure!(text == rust, "{plant}: {where_from} has {text}, Rust has {rust}");
        }
        let functions = audit::run_c(&build::read(&there)?)?;
        println!(
            "c library: {plant} with {}: {rust} in Rust, in C here and on the Cortex-M4; no panic, no heap, {functions} \
             functions in the tick",
            controller.name()
        );
    }
    Ok(())
}

/// Configures and builds the example in `folder`. Returns the path of the program.
fn built(cmake: &Path, folder: &Path, name: &str, library: &Path, options: &[&str]) -> Result<std::path::PathBuf> {
    let build = folder.join(name);
    let mut configure = shell::command(cmake);
    configure.current_dir(folder).args(["-B", name]).args(options).arg(format!("-DVSJ_LIBRARY={}", library.display()));
    shell::output(&mut configure)?;
    shell::output(shell::command(cmake).arg("--build").arg(&build))?;
    Ok(build.join("example"))
}

/// The digest in Rust of the example's ticks, whose inputs are those of [`blocks::inputs`].
fn in_rust(plant: &str, controller: Controller) -> Result<u64> {
    let path = shell::root().join(plant).display().to_string();
    let file = plant_file::load(if plant == "paper" { plant } else { &path })?;
    let mut control = ControlLoop::new(&file, &Options { controller, ..Options::PAPER })?;
    let mut digest = Digest::default();
    control.run(blocks::inputs(), |output| digest.add_output(&output));
    Ok(digest.value())
}
