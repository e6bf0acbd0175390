//! How large the images are, and how deep their stack gets.

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

use crate::image::{self, Board, Opt};
use crate::{elf, stack};

/// Bytes of flash that an image may take, of 512 KB.
const MOST_FLASH: u32 = 64 << 10;
/// Bytes of RAM, stack included.
const MOST_RAM: u32 = 16 << 10;

/// Options of `cargo xtask size`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
    /// Of images with the time-optimal controller, for which there is no bound
    #[arg(long)]
    fast: bool,
    /// Of images with a stiffness sensor in the loop, for which the bounds are the same
    #[arg(long)]
    feedback: bool,
}

impl Args {
    /// Of the firmware's, beside what is flashed.
    fn features(&self) -> Vec<&'static str> {
        let asked = [("fast", self.fast), ("feedback", self.feedback)];
        asked.into_iter().filter_map(|(feature, asked)| asked.then_some(feature)).collect()
    }
}

/// One image.
pub(crate) struct Size {
    board: Board,
    flash: u32,
    statics: u32,
    stack: u32,
    worst: u32,
}

/// `cargo xtask size`.
pub(crate) fn run(args: &Args) -> Result<()> {
    let features = args.features();
    let sizes = Board::ALL.into_iter().map(|board| measure(&features, board)).collect::<Result<Vec<_>>>()?;
    if args.json {
        println!("{}", Value::from(sizes.iter().map(report).collect::<Vec<_>>()));
    } else {
        print!("{}", table(&sizes));
    }
    if args.fast { Ok(()) } else { sizes.iter().try_for_each(check) }
}

/// Builds and measures one image with these features of the firmware's.
pub(crate) fn measure(features: &[&str], board: Board) -> Result<Size> {
    let path = image::build_with(features, board, Opt::S)?;
    let bytes = image::read(&path)?;
    let bottom = elf::symbol(&bytes, "_stack_end")?;
    let top = elf::symbol(&bytes, "_stack_start")?;
    Ok(Size {
        board,
        flash: elf::flash(&bytes)?.bytes.len() as u32,
        statics: elf::ram(&bytes)?,
        stack: top - bottom,
        worst: stack::worst(&bytes).context("the stack's depth")?,
    })
}

/// An error that names the bound that is not kept.
pub(crate) fn check(size: &Size) -> Result<()> {
    let Size { board, flash, statics, stack, worst } = size;
    let name = board.name();
    if *flash > MOST_FLASH {
        bail!("{name}: {flash} bytes of flash, expected at most {MOST_FLASH}");
    }
    if statics + stack > MOST_RAM {
        bail!("{name}: {} bytes of RAM, expected at most {MOST_RAM}", statics + stack);
    }
    if *worst > stack - stack::GUARD {
        bail!("{name}: the stack may need {worst} bytes, {stack} less a guard of {} are there", stack::GUARD);
    }
    Ok(())
}

fn report(size: &Size) -> Value {
    let Size { board, flash, statics, stack, worst } = size;
    json!({"image": board.name(), "flash": flash, "statics": statics, "stack": stack, "worst_stack": worst})
}

fn table(sizes: &[Size]) -> String {
    let mut text = format!("{:<16}{:>8}{:>9}{:>8}{:>13}\n", "bytes", "flash", "statics", "stack", "worst stack");
    for Size { board, flash, statics, stack, worst } in sizes {
        text += &format!("{:<16}{flash:>8}{statics:>9}{stack:>8}{worst:>13}\n", board.name());
    }
    text
}
