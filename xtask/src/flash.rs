//! `cargo xtask flash`: writes the image to the board's flash and shows its log.

use anyhow::{Context, Result};

use xtask::build::{self, Board, Opt};
use xtask::shell;
use xtask::variant::Variant;

/// The MCU's name in probe-rs.
const CHIP: &str = "STM32G474RETx";

/// What helps if it fails.
const HELP: &str = "probe-rs flashes the board; it is installed by `cargo install probe-rs-tools --locked`, and on Linux it needs \
                    the udev rules of https://probe.rs/docs/getting-started/probe-setup/";

/// Builds the board's image and hands it to `probe-rs run`.
pub(crate) fn run(variant: Variant) -> Result<()> {
    // Before the image is built, which takes minutes.
    shell::output(shell::command("probe-rs").arg("--version")).context(HELP)?;
    let elf = build::image_with(&variant.features(), Board::Nucleo, Opt::S)?;
    shell::run(shell::command("probe-rs").args(["run", "--chip", CHIP]).arg(elf)).context(HELP)
}
