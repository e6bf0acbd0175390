//! One module a subcommand.

use std::io::{ErrorKind, Write};
use std::path::PathBuf;

use anyhow::Result;
use host_sim::BadInput;

pub(crate) mod beam;
pub(crate) mod compare;
pub(crate) mod diagnose;
pub(crate) mod dynamics;
pub(crate) mod joint;
pub(crate) mod link;
pub(crate) mod log;
pub(crate) mod reproduce;
pub(crate) mod stair;
pub(crate) mod tune;

/// Prints to stdout; that nobody reads on, as in `vsj stair | head`, is no failure.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// A line for each file that was written.
fn wrote(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| format!("wrote {}\n", path.display())).collect()
}

/// Says which option sets the field that an error begins with; `options` are fields with theirs.
fn named(error: anyhow::Error, options: &[(&str, &str)]) -> anyhow::Error {
    let text = error.to_string();
    let field = text.split(' ').next().unwrap_or_default();
    match options.iter().find(|(name, _)| *name == field) {
        Some((_, option)) => BadInput(format!("{option}: {text}")).into(),
        None => error,
    }
}
