//! The text of a data file, of bounded size: its encoding, its line ends.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind};
use std::path::Path;

use anyhow::Result;
use encoding_rs::{Encoding, UTF_8, WINDOWS_1252};

use crate::bad_input;
use crate::bad_input::BadInput;
use crate::csv_table::Numbering;

/// Largest number of rows: a row of a record takes 40 bytes, its diagnosis 500.
pub const MOST_ROWS: usize = 1_000_000;
/// Largest size of a file, in bytes.
pub const MOST_BYTES: usize = 1 << 29;
/// Largest size of a file in another encoding than UTF-8, in bytes: its text is a second copy.
const MOST_CONVERTED: usize = MOST_BYTES / 8;
/// Largest length of a line, in bytes: a thousand columns of a thousand characters.
const MOST_LINE: usize = 1 << 20;

/// The bytes of a data file and what messages call it.
pub struct Source {
    /// Name in messages.
    pub name: String,
    bytes: Vec<u8>,
    numbering: Numbering,
}

impl Source {
    /// Reads a file; `name` is its path.
    ///
    /// # Errors
    /// [`BadInput`] if the file cannot be opened, and the errors of [`Source::read`].
    pub fn open(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        match File::open(path) {
            Ok(file) => Self::read(&name, BufReader::new(file)),
            Err(error) => bad_input!("{name}: cannot be read: {error}"),
        }
    }

    /// Reads the bytes of a file once, since it may be a pipe, and no further than its limits.
    ///
    /// # Errors
    /// [`BadInput`] if the file cannot be read, is too large, has more than a million rows or a very long line, or is binary.
    pub fn read(name: &str, mut file: impl BufRead) -> Result<Self> {
        let name = name.to_owned();
        let unreadable = |error| BadInput(format!("{name}: cannot be read: {error}"));
        let mut bytes = Vec::new();
        // Lines end with a line feed, a carriage return or both.
        let (mut feeds, mut returns, mut line_start) = (0, 0, 0);
        loop {
            let chunk = match file.fill_buf() {
                Ok([]) => return Ok(Self { name, bytes, numbering: Numbering::Lines }),
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
        Self { name: name.to_owned(), bytes: bytes.into(), numbering: Numbering::Lines }
    }

    /// Wraps the text of [`crate::record::columns::text`], made of a file that has rows and no lines.
    pub fn of_rows(name: &str, text: String) -> Self {
        Self { name: name.to_owned(), bytes: text.into(), numbering: Numbering::Rows }
    }

    /// How messages number the rows.
    pub(crate) fn numbering(&self) -> Numbering {
        self.numbering
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
        let refuse_large = |bytes: usize, encoding: &str| match bytes > MOST_CONVERTED {
            true => Err(BadInput(format!(
                "{name}: more than {} MiB in {encoding}; expected at most that, or UTF-8 (for example by iconv -t UTF-8)",
                MOST_CONVERTED >> 20
            ))),
            false => Ok(()),
        };
        match Encoding::for_bom(&self.bytes) {
            Some((encoding, mark)) if encoding != UTF_8 => {
                refuse_large(self.bytes.len(), encoding.name())?;
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
                    refuse_large(error.as_bytes().len(), "Latin-1")?;
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

/// Removes the byte order mark, and turns carriage returns that stand alone into line feeds, in place: a text may be large.
fn without_mark(mut text: String) -> String {
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    let mut bytes = text.into_bytes();
    for place in 0..bytes.len() {
        if bytes[place] == b'\r' && bytes.get(place + 1) != Some(&b'\n') {
            bytes[place] = b'\n';
        }
    }
    String::from_utf8(bytes).expect("ASCII for ASCII")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lone_carriage_returns_become_line_feeds() {
        let read = |text: &str| Source::new("a", text).utf_8().unwrap();
        assert_eq!(read("\u{feff}a,b\r1,2\r\r\n3,ä\r\n4,5\r"), "a,b\n1,2\n\r\n3,ä\r\n4,5\n");
    }

    /// A second copy of the largest file would need more memory than a diagnosis of a million rows.
    #[test]
    fn large_text_in_another_encoding_is_refused_in_one_line() {
        for start in [&b"a,\xe4\n"[..], b"\xff\xfea\0"] {
            let mut bytes = start.to_vec();
            bytes.resize(MOST_CONVERTED + 2, b'1');
            let error = Source::new("file.csv", bytes).decode().unwrap_err().to_string();
            assert!(error.starts_with("file.csv: more than 64 MiB in ") && !error.contains('\n'), "{error}");
        }
    }
}
