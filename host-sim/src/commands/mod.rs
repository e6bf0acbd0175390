//! One module a subcommand.

use std::io::{ErrorKind, Write};

use anyhow::Result;

pub(crate) mod beam;
pub(crate) mod diagnose;
pub(crate) mod dynamics;
pub(crate) mod joint;
pub(crate) mod link;
pub(crate) mod log;
pub(crate) mod reproduce;
pub(crate) mod stair;

/// Prints to stdout; that nobody reads on, as in `vsj stair | head`, is no failure.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}
