//! `cargo xtask size`: flash, RAM and greatest stack depth of each image, with bounds for all three.

use std::fmt;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use xtask::build::{self, Board, Opt};
use xtask::segments;
use xtask::variant::{Controller, Variant};

use super::{elf, stack};

/// Most bytes of flash that an image may use: half of the bank in which the linker places it.
const MOST_FLASH: u32 = 128 << 10;
/// Most bytes of RAM that any image may use, stack included.
const MOST_RAM: u32 = 16 << 10;
/// Most bytes of RAM that an image with the isolation bank may use, stack included.
const MOST_RAM_ISOLATION: u32 = 24 << 10;
/// Most bytes of RAM that an image with the adaptation may use, stack included.
const MOST_RAM_ADAPTATION: u32 = 32 << 10;

/// Further bytes of RAM for the robust controller: a second spring, and the stack on which it is built.
const MORE_RAM_ROBUST: u32 = 4 << 10;

/// Features of an image with the isolation bank.
pub(crate) const ISOLATION: &[&str] = &["isolation"];

/// Features of an image with the adaptation.
pub(crate) const ADAPTATION: &[&str] = &["adaptation"];

/// Options of `cargo xtask size`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    variant: Variant,
    /// Measure images with a stiffness sensor in the loop; the bounds are the same
    #[arg(long)]
    feedback: bool,
    /// Measure images with a sensor and the isolation bank; 24 KB of RAM are allowed
    #[arg(long)]
    isolation: bool,
    /// Measure images with the adaptation as well; 32 KB of RAM are allowed
    #[arg(long)]
    adaptation: bool,
}

/// Sizes of one image, in bytes.
pub(crate) struct Size {
    board: Board,
    most_ram: u32,
    flash: u32,
    statics: u32,
    stack: u32,
    worst: u32,
}

/// Measures the image of each board and prints the table. An image above a bound is an error.
pub(crate) fn run(args: &Args) -> Result<()> {
    let features: &[&str] = match args {
        Args { adaptation: true, .. } => ADAPTATION,
        Args { isolation: true, .. } => ISOLATION,
        Args { feedback: true, .. } => &["feedback"],
        Args { .. } => &[],
    };
    let sizes =
        Board::ALL.into_iter().map(|board| measure(args.variant, features, board)).collect::<Result<Vec<_>>>()?;
    if args.json {
        println!("{}", Value::from(sizes.iter().map(report).collect::<Vec<_>>()));
    } else {
        print!("{}", table(&sizes));
    }
    sizes.iter().try_for_each(Size::check)
}

/// Builds and measures the image of a variant on one board, with further features of the package `firmware`.
pub(crate) fn measure(variant: Variant, features: &[&str], board: Board) -> Result<Size> {
    let path = build::image_with(&[&variant.features(), features].concat(), board, Opt::S)?;
    let bytes = build::read(&path)?;
    let bottom = elf::symbol(&bytes, "_stack_end")?;
    let top = elf::symbol(&bytes, "_stack_start")?;
    Ok(Size {
        board,
        most_ram: match features {
            ADAPTATION => MOST_RAM_ADAPTATION,
            ISOLATION => MOST_RAM_ISOLATION,
            _ => MOST_RAM,
        } + if variant.controller == Controller::Robust { MORE_RAM_ROBUST } else { 0 },
        flash: segments::flash(&bytes)?.bytes.len() as u32,
        statics: elf::ram(&bytes)?,
        stack: top - bottom,
        worst: stack::worst(&bytes).context("the stack's depth")?,
    })
}

impl Size {
    /// The greatest depth of the stack, in bytes, as computed from the machine code.
    pub(crate) fn worst_stack(&self) -> u32 {
        self.worst
    }

    /// An error that names the first bound that is exceeded.
    pub(crate) fn check(&self) -> Result<()> {
        let Self { board, most_ram, flash, statics, stack, worst } = self;
        let (name, ram) = (board.name(), statics + stack);
        ensure!(*flash <= MOST_FLASH, "{name}: {flash} bytes of flash, expected at most {MOST_FLASH}");
        ensure!(ram <= *most_ram, "{name}: {ram} bytes of RAM, expected at most {most_ram}");
        let left = stack - stack::GUARD;
        ensure!(
            *worst <= left,
            "{name}: the stack may need {worst} bytes, {stack} less a guard of {} are there",
            stack::GUARD
        );
        Ok(())
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { most_ram, flash, statics, stack, worst, .. } = self;
        let ram = statics + stack;
        write!(
            f,
            "{flash} of {MOST_FLASH} bytes of flash, {ram} of {most_ram} of RAM, a stack of {stack} that needs {worst}"
        )
    }
}

fn report(size: &Size) -> Value {
    let Size { board, flash, statics, stack, worst, .. } = size;
    json!({"image": board.name(), "flash": flash, "statics": statics, "stack": stack, "worst_stack": worst})
}

fn table(sizes: &[Size]) -> String {
    let mut text = format!("{:<16}{:>8}{:>9}{:>8}{:>13}\n", "bytes", "flash", "statics", "stack", "worst stack");
    for Size { board, flash, statics, stack, worst, .. } in sizes {
        text += &format!("{:<16}{flash:>8}{statics:>9}{stack:>8}{worst:>13}\n", board.name());
    }
    text
}
