//! `vsj export model`: the model of a spring as the bytes that an MCU stores.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::export::model::{Answer, text, write};
use host_sim::output::files::Files;
use host_sim::output::terminal::{json, print, wrote};

use super::super::plant;

/// Write a spring's model as the bytes that `vsj link PORT model` sends
///
/// The client in C++ sends the file to an MCU, which checks and stores it.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj export model                                the report's spring
  vsj export model --plant out/diagnosis/plant.toml --out out/model

Exit codes: 0 success, 1 the file cannot be written, 2 bad arguments, a plant file that the tick cannot run.")]
pub(crate) struct Arguments {
    /// Spring: `paper` or a plant file of at most 1 MiB
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// Write the file model.bin to this folder
    #[arg(long, value_name = "DIR", default_value = "out/model")]
    out: PathBuf,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let (model, not_run) = plant::wire(&arguments.plant)?;
    let mut files = Files::new(&arguments.out)?;
    let block = write(&model, &mut files)?;
    let paths = files.finish()?;
    let answer = Answer::new(&paths, &block, not_run);
    print(&if arguments.json { json(&answer)? } else { text(&answer) + &wrote(&paths) })
}
