//! `cargo campaign`: diagnoses simulated records with known effects and counts the causes that are named.

mod arguments;
mod done;
mod parts;
mod write;

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use serde_json::{Value, json};
use validation::campaign::real;
use validation::criterion::{self, Criterion};
use validation::isolation;

use crate::arguments::{Cli, Command, Isolation, Part};
use crate::done::Done;
use crate::parts::measured;

fn main() -> ExitCode {
    // Accept `cargo campaign -- singles` as `cargo campaign singles`.
    let arguments = std::env::args().enumerate().filter(|(index, text)| !(*index == 1 && text == "--"));
    let cli = Cli::parse_from(arguments.map(|(_, text)| text));
    let picks = cli.write.is_some() || cli.parts.iter().all(|part| *part == Part::OutOfModel);
    if !cli.record.cause.is_empty() && !picks {
        let message = "--cause: expected --write, or out-of-model as the only part";
        Cli::command().error(ErrorKind::ArgumentConflict, message).exit();
    }
    criterion::exit_code(run(&cli))
}

/// True if every criterion is met.
fn run(cli: &Cli) -> Result<bool> {
    match &cli.command {
        Some(Command::Real { folder, no_python, json }) => return measured_records(folder, !no_python, *json),
        Some(Command::Isolation(options)) => return isolation(options).map(|()| true),
        None => {}
    }
    if let Some(folder) = &cli.write {
        return write::write(folder, &cli.record).map(|()| true);
    }
    if let Some(folder) = &cli.export {
        return cli.export(folder).map(|()| true);
    }
    let mut done: Vec<Done> = Vec::new();
    for &part in &cli.parts {
        let result = cli.part(part)?;
        if let Some(folder) = &cli.docs {
            result.write(folder)?;
        }
        if !cli.json {
            print!("## {}\n\n{}\n{}", part.title(), result.markdown, result.wrong);
            result.criteria.iter().for_each(|criterion| println!("- {criterion}"));
            println!();
        }
        done.push(result);
    }
    if cli.json {
        let parts: serde_json::Map<_, _> = done.iter().map(|done| (done.part.key(), done.json.clone())).collect();
        println!("{}", Value::Object(parts));
    }
    Ok(done.iter().flat_map(|done| &done.criteria).all(Criterion::is_met))
}

/// Identifies and diagnoses the measured records of a folder; true if none was refused.
fn measured_records(folder: &Path, python: bool, json: bool) -> Result<bool> {
    let (subjects, mut refused) = real::open(folder)?;
    let (rows, later) = measured("real", &subjects, python)?;
    refused.extend(later);
    if json {
        println!("{}", json!({ "real": rows, "refused": refused }));
    } else {
        print!("{}", real::table(&rows));
    }
    refused.iter().for_each(|record| eprintln!("{}: refused: {}", record.name, record.reason));
    Ok(refused.is_empty())
}

/// Runs the fault isolation, and writes the results to a page, in which what is written by hand stays.
fn isolation(options: &Isolation) -> Result<()> {
    let text = isolation::page(options.first_seed, options.records)?;
    print!("{text}");
    if let Some(path) = &options.docs {
        let page = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let by_hand = page.split(isolation::TITLE).next().unwrap_or_default();
        std::fs::write(path, format!("{by_hand}{text}")).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
