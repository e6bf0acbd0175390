//! One module a subcommand.

use std::io::{ErrorKind, Write};
use std::path::PathBuf;

use anyhow::Result;
use simulation::bad_input::BadInput;

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
mod voltage;

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

/// Says which option sets the field that an error begins with; `options` are fields, or tables of them, with theirs.
fn named(error: anyhow::Error, options: &[(&str, &str)]) -> anyhow::Error {
    let text = error.to_string();
    let field = text.split(' ').next().unwrap_or_default();
    let table = field.split_inclusive('.').next().unwrap_or_default();
    match options.iter().find(|(name, _)| *name == field || *name == table) {
        Some((_, option)) => BadInput(format!("{option}: {text}")).into(),
        None => error,
    }
}

/// Of the fields of [`model::Settings`], the options that `stair`, `compare` and `tune` have in common.
const SETTINGS: &[(&str, &str)] = &[
    ("rate_hz", "--rate-hz"),
    ("full_scale_v", "--limit-v"),
    ("max_v", "--limit-v"),
    ("slew_v_per_s", "--slew-v-per-s"),
    ("share", "--plant"),
    ("time_constant_s", "--plant"),
    ("relaxation.", "--plant"),
    ("memory.", "--plant"),
    ("law.", "--plant"),
    ("leakage.", "--plant"),
];
