//! `vsj reproduce`: every printed number of the source report, computed again.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::files::Files;
use host_sim::output::reproduce::{page, text};
use host_sim::output::terminal::{json, print, wrote};
use paper::reproduce::reproduce;

/// Recompute every printed number of the source report; list and explain those that disagree
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj reproduce                       disagreements, with explanations
  vsj reproduce --json                every number
  vsj reproduce --out docs/reproduce  as a page

The printed numbers are in data/printed.toml and the tables that it names.")]
pub(crate) struct Arguments {
    /// Write README.md, a page with every number, to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let report = reproduce()?;
    let mut written = String::new();
    if let Some(folder) = &arguments.out {
        let mut files = Files::new(folder)?;
        files.add("README.md", |out| out.write_all(page(&report).as_bytes()))?;
        written = wrote(&files.finish()?);
    }
    print(&if arguments.json { json(&report)? } else { text(&report) + &written })
}
