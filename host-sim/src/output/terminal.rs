//! The terminal: answers go to stdout, remarks to stderr.

use std::io::{ErrorKind, Write};
use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;

/// Prints `text` to stdout. A pipe closed by its reader, as in `vsj stair | head`, is no failure.
///
/// # Errors
/// If stdout cannot be written for another reason.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// One JSON object as a line of text.
///
/// # Errors
/// If `value` has a map whose keys are not strings.
pub fn json(value: &impl Serialize) -> Result<String> {
    Ok(serde_json::to_string(value)? + "\n")
}

/// Prints a remark or an error to stderr as one line that names the program; line breaks in `text` become spaces.
pub fn remark(text: &str) {
    eprintln!("vsj: {}", text.replace(['\n', '\r'], " "));
}

/// One line `wrote PATH` for each written file.
pub fn wrote(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| format!("wrote {}\n", path.display())).collect()
}
