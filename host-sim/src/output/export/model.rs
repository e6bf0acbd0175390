//! File of `vsj export model`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use link::{BlockId, WireModel};
use serde::Serialize;

use crate::output::files::Files;

/// Name of the file.
const FILE: &str = "model.bin";

/// The answer of `vsj export model --json`.
#[derive(Debug, Serialize)]
pub struct Answer {
    schema: u32,
    files: Vec<String>,
    format: u8,
    length: u16,
    checksum: u32,
    not_run: Vec<String>,
}

impl Answer {
    /// The answer about a file that was written; `not_run` is what of the plant file an MCU does not run.
    pub fn new(paths: &[PathBuf], block: &BlockId, not_run: Vec<String>) -> Self {
        let files = paths.iter().filter_map(|path| path.file_name());
        let files = files.map(|name| name.to_string_lossy().into_owned()).collect();
        let BlockId { format, length, checksum, .. } = *block;
        Self { schema: 1, files, format, length, checksum, not_run }
    }
}

/// Adds the payload of a model, without its parts and frames; returns the identity that it has on an MCU, but for its number.
///
/// # Errors
/// If the file cannot be written.
pub fn write(model: &WireModel, files: &mut Files) -> Result<BlockId> {
    let payload = model.payload().context("the model is longer than an MCU can store")?;
    files.add(FILE, |out| out.write_all(&payload))?;
    Ok(BlockId::of(0, &payload))
}

/// The answer for a terminal, in the words of `vsj link PORT model`.
pub fn text(answer: &Answer) -> String {
    let Answer { format, length, checksum, .. } = answer;
    format!("format {format}, {length} bytes, CRC {checksum:08x}\n")
}
