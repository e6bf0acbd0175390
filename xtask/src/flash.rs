//! Writes the real board's image to its flash and shows its log.

use anyhow::{Context, Result};

use crate::image::{self, Board, Opt};
use crate::shell;
use crate::variant::Variant;

/// As probe-rs names it.
const CHIP: &str = "STM32G474RETx";

/// `cargo xtask flash`.
pub(crate) fn run(variant: Variant) -> Result<()> {
    let elf = image::build_with(&variant.features(), Board::Nucleo, Opt::S)?;
    shell::run(shell::command("probe-rs").args(["run", "--chip", CHIP]).arg(elf))
        .context("probe-rs flashes the board (cargo install probe-rs-tools --locked)")
}
