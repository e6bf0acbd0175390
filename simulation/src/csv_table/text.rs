//! Where the text of a table comes from: a file, a pipe or the memory.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor};
use std::path::Path;

use anyhow::Result;

use super::Numbering;
use crate::bad_input;

/// Largest number of rows: a row of a record takes 64 bytes, its diagnosis 500.
pub const MOST_ROWS: usize = 1_000_000;
/// Largest size of a file, in bytes.
pub const MOST_BYTES: usize = 1 << 29;

/// A data file that has not been read yet, and what messages call it. It is read once, since it may be a pipe.
pub struct Source<'a> {
    /// Name in messages.
    pub name: String,
    pub(super) bytes: Box<dyn BufRead + 'a>,
    pub(super) numbering: Numbering,
    /// True if any other encoding is an error.
    pub(super) is_utf_8: bool,
}

impl<'a> Source<'a> {
    /// Opens a file; `name` is its path.
    ///
    /// # Errors
    /// [`crate::bad_input::BadInput`] if the file cannot be opened.
    pub fn open(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        match File::open(path) {
            Ok(file) => Ok(Self::read(&name, BufReader::new(file))),
            Err(error) => bad_input!("{name}: cannot be read: {error}"),
        }
    }

    /// Reads what is left of an open file.
    pub fn read(name: &str, file: impl BufRead + 'a) -> Self {
        Self { name: name.to_owned(), bytes: Box::new(file), numbering: Numbering::Lines, is_utf_8: false }
    }

    /// Wraps bytes that were read elsewhere.
    pub fn new(name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        Self::read(name, Cursor::new(bytes.into()))
    }

    /// Wraps the text of columns whose rows are numbered in this way.
    pub(crate) fn of_columns(name: &str, text: String, numbering: Numbering) -> Self {
        Self { numbering, ..Self::new(name, text) }
    }

    /// Returns this source with any encoding but UTF-8 as an error.
    pub fn expect_utf_8(self) -> Self {
        Self { is_utf_8: true, ..self }
    }

    /// How messages number the rows.
    pub(crate) fn numbering(&self) -> Numbering {
        self.numbering
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_a_text_end_with_line_feeds() {
        let read = |text: &str| Source::new("a", text).utf_8().unwrap();
        assert_eq!(read("\u{feff}a,b\r1,2\r\r\n3,ä\r\n4,5\r"), "a,b\n1,2\n\n3,ä\n4,5\n");
    }
}
