//! The text of a data file, of bounded size: its encoding, its line ends.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind};
use std::path::Path;

use anyhow::Result;
use encoding_rs::{Encoding, UTF_8, WINDOWS_1252};

use crate::bad_input;
use crate::bad_input::BadInput;

/// Largest number of rows: a row of a record takes 40 bytes, its diagnosis 500.
const MOST_ROWS: usize = 1_000_000;
/// Largest size of a file, in bytes.
const MOST_BYTES: usize = 1 << 29;
/// Largest length of a line, in bytes: a thousand columns of a thousand characters.
const MOST_LINE: usize = 1 << 20;

/// The bytes of a data file and what messages call it.
pub struct Source {
    /// Name in messages.
    pub name: String,
    bytes: Vec<u8>,
}

impl Source {
    /// Reads a file once, since it may be a pipe, and no further than its limits.
    ///
    /// # Errors
    /// [`BadInput`] if the file cannot be read, is too large, has more than a million rows or a very long line, or is binary.
    pub fn open(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let unreadable = |error| BadInput(format!("{name}: cannot be read: {error}"));
        let mut file = BufReader::new(File::open(path).map_err(unreadable)?);
        let mut bytes = Vec::new();
        // Lines end with a line feed, a carriage return or both.
        let (mut feeds, mut returns, mut line_start) = (0, 0, 0);
        loop {
            let chunk = match file.fill_buf() {
                Ok([]) => return Ok(Self { name, bytes }),
                Ok(chunk) => chunk,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => return Err(unreadable(error).into()),
            };
            for (place, byte) in (bytes.len()..).zip(chunk) {
                match byte {
                    b'\n' => feeds += 1,
                    b'\r' => returns += 1,
                    _ => continue,
                }
                line_start = place + 1;
            }
            let chunk_length = chunk.len();
            bytes.extend_from_slice(chunk);
            file.consume(chunk_length);

            let lines = feeds.max(returns);
            let shorter = "expected at most that: keep every tenth row, or a part of the record";
            if bytes.len() >= MOST_BYTES {
                bad_input!("{name}: more than {} MiB; {shorter}", MOST_BYTES >> 20);
            }
            if lines > MOST_ROWS + 1 {
                bad_input!("{name}: more than {MOST_ROWS} lines; {shorter}");
            }
            if bytes.len() - line_start > MOST_LINE {
                bad_input!("{name}, line {}: longer than {} MiB; expected a line of CSV", lines + 1, MOST_LINE >> 20);
            }
            let has_16_bits = Encoding::for_bom(&bytes).is_some_and(|(encoding, _)| encoding != UTF_8);
            if !has_16_bits && bytes[bytes.len() - chunk_length..].contains(&0) {
                bad_input!(
                    "{name}: a byte 0, as in a binary file; expected a text in UTF-8, or in UTF-16 with its mark"
                );
            }
        }
    }

    /// Wraps bytes that were read elsewhere.
    pub fn new(name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        Self { name: name.to_owned(), bytes: bytes.into() }
    }

    /// Returns the text of a file in UTF-8, with or without byte order mark.
    ///
    /// # Errors
    /// [`BadInput`] with the first line in another encoding.
    pub fn utf_8(self) -> Result<String> {
        match String::from_utf8(self.bytes) {
            Ok(text) => Ok(without_mark(text)),
            Err(error) => {
                let line = line_at(error.as_bytes(), error.utf8_error().valid_up_to());
                bad_input!("{}, line {line}: not UTF-8; expected a text in UTF-8", self.name)
            }
        }
    }

    /// Returns the text of a file in UTF-8, in UTF-16 with byte order mark or, if it is neither, in Windows-1252, which
    /// contains Latin-1. For the last two, a remark says so.
    ///
    /// # Errors
    /// [`BadInput`] for invalid UTF-16.
    pub fn decode(self) -> Result<(String, Option<String>)> {
        let name = &self.name;
        match Encoding::for_bom(&self.bytes) {
            Some((encoding, mark)) if encoding != UTF_8 => {
                let Some(text) = encoding.decode_without_bom_handling_and_without_replacement(&self.bytes[mark..])
                else {
                    bad_input!("{name}: not {}, although it starts with its mark; expected UTF-8", encoding.name());
                };
                let remark = format!("{name}: read as {}; UTF-8 is the usual encoding", encoding.name());
                Ok((without_mark(text.into_owned()), Some(remark)))
            }
            _ => match String::from_utf8(self.bytes) {
                Ok(text) => Ok((without_mark(text), None)),
                Err(error) => {
                    let line = line_at(error.as_bytes(), error.utf8_error().valid_up_to());
                    let text = WINDOWS_1252.decode_without_bom_handling(error.as_bytes()).0.into_owned();
                    let remark = format!("{name}, line {line}: not UTF-8; read as Latin-1 (Windows-1252)");
                    Ok((without_mark(text), Some(remark)))
                }
            },
        }
    }
}

/// Number of the line of a byte, from 1.
fn line_at(bytes: &[u8], place: usize) -> usize {
    bytes[..place].iter().filter(|byte| **byte == b'\n').count() + 1
}

/// Removes the byte order mark, and turns carriage returns that stand alone into line feeds.
fn without_mark(mut text: String) -> String {
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    let is_lone = |(place, _): (usize, &str)| text.as_bytes().get(place + 1) != Some(&b'\n');
    if text.match_indices('\r').any(is_lone) { text.replace("\r\n", "\n").replace('\r', "\n") } else { text }
}
