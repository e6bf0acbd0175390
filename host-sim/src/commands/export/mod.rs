//! `vsj export`: spring and controller for other programs.

mod fmu;

use anyhow::Result;
use clap::{Args, Subcommand};

/// Export spring and controller for other programs: FMI units, C
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj export fmu --plant spring.toml        six units, for FMI 2.0 and 3.0")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    Fmu(fmu::Arguments),
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.command {
        Command::Fmu(arguments) => fmu::run(arguments),
    }
}
