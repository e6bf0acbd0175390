//! `vsj`: host tools for the stiffness controller of a piezo variable-stiffness spring.
// They panic on a closed pipe; `vsj` prints in its `output::terminal`.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod commands;

use std::process::ExitCode;

use anyhow::Result;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use host_sim::output::terminal::{has_reader, remark};
use host_sim::signals;
use simulation::bad_input::BadInput;

/// Simulates the variable-stiffness spring and its controller, with the code that runs in the amplifier's MCU.
///
/// Without a command it runs the report's stair experiment and writes its files to out/stair.
#[derive(Parser)]
#[command(
    name = "vsj",
    version = host_sim::VERSION,
    after_help = "Exit codes: 0 success, 1 the command failed or stdout cannot be written, 2 bad arguments or bad input."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Adapt(commands::adapt::Arguments),
    Beam(commands::beam::Arguments),
    Bound(commands::bound::Arguments),
    Compare(commands::compare::Arguments),
    Completions(commands::completions::Completions),
    Diagnose(commands::diagnose::Arguments),
    Dynamics(commands::dynamics::Arguments),
    Export(commands::export::Arguments),
    Identify(commands::identify::Arguments),
    Isolate(commands::isolate::Arguments),
    Joint(commands::joint::Arguments),
    Link(commands::link::Arguments),
    Log(commands::log::Arguments),
    Man(commands::completions::Manual),
    Plan(commands::plan::Arguments),
    Reproduce(commands::reproduce::Arguments),
    Stair(commands::stair::Arguments),
    Tune(commands::tune::Arguments),
    Watch(commands::watch::Arguments),
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    if let Err(error) = signals::handle() {
        remark(&format!("signals cannot be handled: {error}"));
    }
    let done = match cli.command {
        Some(Command::Adapt(arguments)) => commands::adapt::run(&arguments),
        Some(Command::Beam(arguments)) => commands::beam::run(&arguments),
        Some(Command::Bound(arguments)) => commands::bound::run(&arguments),
        Some(Command::Compare(arguments)) => commands::compare::run(&arguments),
        Some(Command::Completions(arguments)) => commands::completions::completions(&arguments, Cli::command()),
        Some(Command::Diagnose(arguments)) => commands::diagnose::run(&arguments),
        Some(Command::Dynamics(arguments)) => commands::dynamics::run(&arguments),
        Some(Command::Export(arguments)) => commands::export::run(&arguments),
        Some(Command::Identify(arguments)) => commands::identify::run(&arguments),
        Some(Command::Isolate(arguments)) => commands::isolate::run(&arguments),
        Some(Command::Joint(arguments)) => commands::joint::run(&arguments),
        Some(Command::Link(arguments)) => commands::link::run(&arguments),
        Some(Command::Log(arguments)) => commands::log::run(&arguments),
        Some(Command::Man(arguments)) => commands::completions::manual(&arguments, Cli::command()),
        Some(Command::Plan(arguments)) => commands::plan::run(&arguments),
        Some(Command::Reproduce(arguments)) => commands::reproduce::run(&arguments),
        Some(Command::Stair(arguments)) => commands::stair::run(&arguments),
        Some(Command::Tune(arguments)) => commands::tune::run(&arguments),
        Some(Command::Watch(arguments)) => commands::watch::run(&arguments),
        None => commands::stair::run(&commands::stair::Arguments::main_job()),
    };
    exit_code(done)
}

/// Prints an error as one line; returns the exit code.
fn exit_code(done: Result<()>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            remark(&format!("{error:#}"));
            ExitCode::from(if error.is::<BadInput>() { 2 } else { 1 })
        }
    }
}

/// Prints help and version in full, and a wrong argument as one line; returns the exit code.
fn usage(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        return exit_code(has_reader(error.print()).map(drop));
    }
    remark(&one_line(error));
    ExitCode::from(2)
}

fn one_line(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let what: Vec<&str> = text
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"))
        .filter(|line| !line.is_empty())
        .collect();
    // clap lists the missing subcommand, but not the arguments before it, which the usage line shows.
    let usage = text.lines().find(|line| line.starts_with("Usage:") && error.kind() == ErrorKind::MissingSubcommand);
    format!("{}; {}", what.join(" ").trim_start_matches("error: "), usage.unwrap_or("see `--help`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Width of a terminal, in columns; a longer example would be wrapped and could not be copied.
    const COLUMNS: usize = 80;

    #[test]
    fn missing_arguments_are_named() {
        for (line, missing) in [
            ("vsj link", "'vsj link' requires a subcommand but one was not provided [subcommands: status,"),
            ("vsj link", "; Usage: vsj link [OPTIONS] <PORT> <COMMAND>"),
            ("vsj export", "'vsj export' requires a subcommand but one was not provided [subcommands: c, fmu, model,"),
            ("vsj diagnose", "not provided: <DATA.csv>...; see `--help`"),
            ("vsj stair --overshoot-percent 5", "not provided: --known <KEY=PERCENT>; see `--help`"),
        ] {
            let said = one_line(&Cli::try_parse_from(line.split(' ')).err().expect("something is missing"));
            assert!(said.contains(missing) && !said.contains('\n'), "{line}: {said}");
        }
    }

    #[test]
    fn every_example_in_a_help_text_fits_the_terminal_and_parses() {
        let (mut examples, mut commands) = (0, vec![Cli::command()]);
        while let Some(command) = commands.pop() {
            commands.extend(command.get_subcommands().cloned());
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            for line in help.lines().filter(|line| line.starts_with("  ")) {
                assert!(line.len() <= COLUMNS, "{} columns: {line}", line.len());
                // Without the other parts of the shell command and without the comment.
                let words = &line[line.find("vsj").expect("an example of vsj")..];
                let words = words.split("  ").next().into_iter().flat_map(|words| words.split(['|', '>'])).next();
                let words = words.unwrap_or_default();
                let parsed = Cli::try_parse_from(words.split_whitespace());
                assert!(parsed.is_ok(), "{line}: {}", parsed.err().map(|error| error.to_string()).unwrap_or_default());
                examples += 1;
            }
        }
        assert!(examples > 30, "{examples} examples");
    }
}
