//! `vsj export`: spring and controller for other programs.

mod c;
mod fmu;
mod model;

use anyhow::Result;
use clap::{Args, Subcommand};

/// Export spring and controller for other programs: FMI units, C, the model for an MCU
#[derive(Args, Debug)]
#[command(
    arg_required_else_help = false,
    after_help = "\
Examples:
  vsj export fmu --plant spring.toml        six units, for FMI 2.0 and 3.0
  vsj export c --plant spring.toml          header, settings and an example
  vsj export model --plant spring.toml      for the client of the link in C++"
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    C(c::Arguments),
    Fmu(fmu::Arguments),
    Model(model::Arguments),
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.command {
        Command::C(arguments) => c::run(arguments),
        Command::Fmu(arguments) => fmu::run(arguments),
        Command::Model(arguments) => model::run(arguments),
    }
}
