//! Writes the real board's image to its flash and shows its log.

use anyhow::{Context, Result};

use crate::controller::Controller;
use crate::image::{self, Board, Opt};
use crate::shell;

/// As probe-rs names it.
const CHIP: &str = "STM32G474RETx";

/// `cargo xtask flash`.
pub(crate) fn run(controller: Controller) -> Result<()> {
    let elf = image::build_with(controller.features(), Board::Nucleo, Opt::S)?;
    shell::run(shell::command("probe-rs").args(["run", "--chip", CHIP]).arg(elf))
        .context("probe-rs flashes the board (cargo install probe-rs-tools --locked)")
}
