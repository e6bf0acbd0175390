//! The terminal: answers go to stdout, remarks to stderr. Output that is lost never ends the program with a panic.

use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;

use anyhow::{Context, Result};
use serde::Serialize;

/// Prints `text` to stdout. A pipe closed by its reader, as in `vsj stair | head`, is no failure.
///
/// # Errors
/// If stdout cannot be written for another reason, such as a full device.
pub fn print(text: &str) -> Result<()> {
    print_to_reader(text).map(drop)
}

/// Prints `text` to stdout like [`print()`]; returns false if its reader has closed the pipe.
///
/// # Errors
/// If stdout cannot be written for another reason, such as a full device.
pub fn print_to_reader(text: &str) -> Result<bool> {
    let mut out = io::stdout().lock();
    has_reader(out.write_all(text.as_bytes()).and_then(|()| out.flush()))
}

/// Converts the result of writing to stdout into true, or false if its reader has closed the pipe.
///
/// # Errors
/// If stdout could not be written for another reason.
pub fn has_reader(written: io::Result<()>) -> Result<bool> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        written => written.map(|()| true).context("stdout cannot be written"),
    }
}

/// Writes `text` to stderr. A failure is ignored, because there is no other place to report it.
pub fn print_error(text: &str) {
    let _ = io::stderr().write_all(text.as_bytes());
}

/// Prints a remark or an error to stderr as one line that names the program; line breaks in `text` become spaces.
pub fn remark(text: &str) {
    print_error(&format!("vsj: {}\n", text.replace(['\n', '\r'], " ")));
}

/// One JSON object as a line of text.
///
/// # Errors
/// If `value` has a map whose keys are not strings.
pub fn json(value: &impl Serialize) -> Result<String> {
    Ok(serde_json::to_string(value)? + "\n")
}

/// Quotes a word for a shell where necessary.
pub fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "-_./=:,+@%".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// One line `wrote PATH` for each written file.
pub fn wrote(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| format!("wrote {}\n", path.display())).collect()
}
