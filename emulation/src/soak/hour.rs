//! `cargo xtask soak --emulated`: an hour of the emulated board, compared with the same code on the host.
//!
//! It is long enough for the time base to wrap 26 times (after 134 s, which no other run reaches), and every task, the watchdogs, log and
//! DAC take part, which the ticks on the host do not have.

use std::time::Duration;

use anyhow::{Context, Result};
use xtask::build::{self, Board, Opt};
use xtask::setup;
use xtask::tally::Tally;

use crate::qemu::comparison::Comparison;
use crate::qemu::emulator;

/// The script.
const SCRIPT: &str = "hour 1";
/// Longest time of the run on the host's clock.
const MOST: Duration = Duration::from_secs(3600);

/// Runs the hour and prints what it was.
pub(super) fn run() -> Result<()> {
    setup::emulator()?;
    let run = emulator::play_long(&build::image(Board::Mps2, Opt::S)?, SCRIPT, MOST)?;
    let comparison = Comparison::new(SCRIPT, &run)?;
    println!("{}", comparison.summary(&run));
    comparison.check().context("an hour on the emulated board")?;
    let counts = [("ticks on the emulated board, every code and estimate as on the host", comparison.ticks.into())];
    Tally::now(counts.map(|(what, count)| (what.to_owned(), count)))?.write("soak-emulated")
}
