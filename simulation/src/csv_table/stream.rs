//! The text of a table as a stream: its encoding, its line ends, its bounds. Only a few lines of it are in memory.

use std::collections::VecDeque;
use std::io::{self, BufRead, ErrorKind, Read};
use std::mem;

use encoding_rs::{Decoder, DecoderResult, Encoding, UTF_8, WINDOWS_1252};

use super::dialect::{Separator, is_above_header};
use super::header::{self, CHECKED_ROWS, MOST_TITLES};
use super::text::{MOST_BYTES, MOST_ROWS, Source};
use crate::bad_input::BadInput;

/// Largest length of a line, in bytes: a thousand columns of a thousand characters.
const MOST_LINE: usize = 1 << 20;
/// Largest number of bytes that are decoded together.
const CHUNK: usize = 1 << 16;
/// Largest part of a table in which its separator is searched, in bytes.
const MOST_HEAD: usize = 1 << 24;
/// Length of a byte order mark of UTF-8, the longest one, in bytes.
const LONGEST_MARK: usize = 3;

/// The text of a [`Source`] in UTF-8, with line feeds as line ends. Its errors contain a [`BadInput`] each.
pub(super) struct Stream<'a> {
    name: String,
    bytes: Box<dyn BufRead + 'a>,
    is_utf_8: bool,
    encoding: Form,
    /// Bytes that are not decoded, among them an incomplete character from the chunk before.
    raw: Vec<u8>,
    /// Number of bytes that were read.
    read: usize,
    has_ended: bool,
    /// Decoded text, handed out up to `handed`.
    text: Vec<u8>,
    handed: usize,
    lines: Lines,
    /// The last comment above the header, without its mark, and its line.
    comment: Option<(usize, String)>,
    /// What the user should know about the encoding.
    remark: Option<String>,
}

/// The encoding of a stream, as far as its bytes have shown.
enum Form {
    Unknown,
    Utf8,
    Utf16(Decoder),
    /// Windows-1252, which contains Latin-1: what is not UTF-8, from its first such byte on.
    Latin1,
}

impl<'a> Stream<'a> {
    pub(super) fn new(Source { name, bytes, is_utf_8, .. }: Source<'a>) -> Self {
        Self {
            name,
            bytes,
            is_utf_8,
            encoding: Form::Unknown,
            raw: Vec::new(),
            read: 0,
            has_ended: false,
            text: Vec::new(),
            handed: 0,
            lines: Lines::default(),
            comment: None,
            remark: None,
        }
    }

    /// Reads the comments above the header; returns the separator that a line among them names.
    pub(super) fn skip_preamble(&mut self) -> Result<Option<Separator>, BadInput> {
        let mut separator = None;
        for number in 1.. {
            self.skip(0);
            let end = loop {
                match self.pending().iter().position(|byte| *byte == b'\n') {
                    Some(feed) => break feed + 1,
                    None if self.has_ended => break self.pending().len(),
                    None => self.fill()?,
                }
            };
            let line = whole_characters(&self.pending()[..end]);
            let named = Separator::named_by(line);
            if line.is_empty() || (named.is_none() && !is_above_header(line)) {
                break;
            }
            let comment = line.trim().trim_start_matches(['#', '%', '/']);
            self.comment = (!comment.is_empty()).then(|| (number, comment.to_owned())).or(self.comment.take());
            separator = named.or(separator);
            self.skip(end);
        }
        Ok(separator)
    }

    /// The last comment above the header, without its mark, and its line.
    pub(super) fn last_comment(&self) -> Option<(usize, &str)> {
        self.comment.as_ref().map(|(line, text)| (*line, text.as_str()))
    }

    /// Reads the lines of text between the comments and the header; returns the separator of the columns, and the number of the
    /// header's line if it is not the first one. Where no line can be the header, the first one is.
    pub(super) fn skip_titles(&mut self, known: Option<Separator>) -> Result<(Separator, Option<usize>), BadInput> {
        // What is read ahead remains in memory: only a file with titles needs more than a header, labels, units and rows.
        let head = self.head(3 + CHECKED_ROWS)?;
        if let [first] = *header::candidates(head, known, 1) {
            return Ok((first.separator, None));
        }
        let head = self.head(MOST_TITLES + 3 + CHECKED_ROWS)?;
        match *header::candidates(head, known, MOST_TITLES + 1) {
            [] => Ok((header::separator(head, known), None)),
            [only] => {
                self.skip(only.start);
                Ok((only.separator, (only.start > 0).then(|| self.line_at(0))))
            }
            [first, second, ..] => {
                let [first, second] = [first, second].map(|line| self.line_at(line.start as u64));
                let name = &self.name;
                Err(BadInput(format!(
                    "{name}, lines {first} and {second}: each can be the header; expected one line of names above the rows, at \
                     most a line of units below it, and `#` before any other"
                )))
            }
        }
    }

    /// Hands out nothing of the next `bytes` bytes of text, which end with a line; line numbers are searched behind them.
    fn skip(&mut self, bytes: usize) {
        self.handed += bytes;
        self.lines.origin = self.lines.length - self.pending().len();
        self.lines.skip_to(self.lines.origin);
    }

    /// Returns the first `rows` lines that are neither blank nor comments, with what is between and behind them; fewer where
    /// the text ends or has very long lines. They remain to be read.
    pub(super) fn head(&mut self, rows: usize) -> Result<&str, BadInput> {
        while self.lines.starts.len() <= rows && !self.has_ended && self.pending().len() < MOST_HEAD {
            self.fill()?;
        }
        Ok(whole_characters(self.pending()))
    }

    /// Number of the line at a byte of what was read below the preamble, or of the next one that is neither blank nor a
    /// comment; from 1. The bytes must not decrease from call to call.
    pub(super) fn line_at(&mut self, byte: u64) -> usize {
        self.lines.skip_to(self.lines.origin + byte as usize);
        self.lines.starts.front().map_or(self.lines.number, |(_, number)| *number)
    }

    /// What the user should know about the encoding of what was read so far.
    pub(super) fn remark(&self) -> Option<&str> {
        self.remark.as_deref()
    }

    /// The text that was decoded and not handed out.
    fn pending(&self) -> &[u8] {
        &self.text[self.handed..]
    }

    /// Reads and decodes a further chunk.
    fn fill(&mut self) -> Result<(), BadInput> {
        let Self { name, bytes, raw, .. } = self;
        let chunk = match bytes.fill_buf() {
            Ok(chunk) => &chunk[..chunk.len().min(CHUNK)],
            Err(error) if error.kind() == ErrorKind::Interrupted => return Ok(()),
            Err(error) => return Err(BadInput(format!("{name}: cannot be read: {error}"))),
        };
        raw.extend_from_slice(chunk);
        let length = chunk.len();
        bytes.consume(length);
        self.has_ended = length == 0;
        self.read += length;
        self.text.drain(..mem::take(&mut self.handed));
        self.decode()?;
        let shorter = "expected at most that: keep every tenth row, or a part of the record";
        if self.read >= MOST_BYTES {
            return Err(BadInput(format!("{}: more than {} MiB; {shorter}", self.name, MOST_BYTES >> 20)));
        }
        if self.lines.number > MOST_ROWS + 2 {
            return Err(BadInput(format!("{}: more than {MOST_ROWS} lines; {shorter}", self.name)));
        }
        if self.lines.length - self.lines.start > MOST_LINE {
            let (name, line) = (&self.name, self.lines.number);
            let most = MOST_LINE >> 20;
            return Err(BadInput(format!("{name}, line {line}: longer than {most} MiB; expected a line of CSV")));
        }
        Ok(())
    }

    fn is_not_utf_8(&self) -> BadInput {
        BadInput(format!("{}, line {}: not UTF-8; expected a text in UTF-8", self.name, self.lines.number))
    }

    /// Decodes the bytes that were read, apart from an incomplete character at their end.
    fn decode(&mut self) -> Result<(), BadInput> {
        loop {
            let name = &self.name;
            if !matches!(self.encoding, Form::Unknown | Form::Utf16(_)) && self.raw.contains(&0) {
                return Err(BadInput(format!(
                    "{name}: a byte 0, as in a binary file; expected a text in UTF-8, or in UTF-16 with its mark"
                )));
            }
            match &mut self.encoding {
                Form::Unknown if self.raw.len() < LONGEST_MARK && !self.has_ended => return Ok(()),
                Form::Unknown => {
                    let (encoding, mark) = Encoding::for_bom(&self.raw).unwrap_or((UTF_8, 0));
                    self.encoding = if encoding == UTF_8 {
                        Form::Utf8
                    } else if self.is_utf_8 {
                        return Err(self.is_not_utf_8());
                    } else {
                        self.remark = Some(format!("{name}: read as {}; UTF-8 is the usual encoding", encoding.name()));
                        Form::Utf16(encoding.new_decoder_without_bom_handling())
                    };
                    self.raw.drain(..mark);
                }
                Form::Utf8 => {
                    let (valid, error) = match std::str::from_utf8(&self.raw) {
                        Ok(text) => (text.len(), None),
                        Err(error) => (error.valid_up_to(), Some(error)),
                    };
                    let text = String::from_utf8_lossy(&self.raw[..valid]);
                    self.lines.add(&text, &mut self.text);
                    self.raw.drain(..valid);
                    if error.is_none_or(|error| error.error_len().is_none() && !self.has_ended) {
                        return Ok(());
                    }
                    if self.is_utf_8 {
                        return Err(self.is_not_utf_8());
                    }
                    let line = self.lines.number;
                    self.remark =
                        Some(format!("{}, line {line}: not UTF-8; read as Latin-1 (Windows-1252)", self.name));
                    self.encoding = Form::Latin1;
                }
                Form::Latin1 => {
                    let text = WINDOWS_1252.decode_without_bom_handling(&self.raw).0;
                    self.lines.add(&text, &mut self.text);
                    self.raw.clear();
                    return Ok(());
                }
                Form::Utf16(decoder) => {
                    let longest = decoder.max_utf8_buffer_length_without_replacement(self.raw.len());
                    let mut text = String::with_capacity(longest.expect("a chunk is small"));
                    let (result, read) =
                        decoder.decode_to_string_without_replacement(&self.raw, &mut text, self.has_ended);
                    if let DecoderResult::Malformed(..) = result {
                        let encoding = decoder.encoding().name();
                        return Err(BadInput(format!(
                            "{name}: not {encoding}, although it starts with its mark; expected UTF-8"
                        )));
                    }
                    self.lines.add(&text, &mut self.text);
                    self.raw.drain(..read);
                    return Ok(());
                }
            }
        }
    }
}

/// A part of the text that begins and ends between characters.
fn whole_characters(text: &[u8]) -> &str {
    std::str::from_utf8(text).expect("the text is UTF-8, and cut at the ends of lines")
}

impl Read for Stream<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.handed == self.text.len() && !self.has_ended {
            self.fill().map_err(io::Error::other)?;
        }
        let length = self.pending().read(buffer)?;
        self.handed += length;
        Ok(length)
    }
}

/// The lines of a text that grows.
struct Lines {
    /// Length of the text so far, in bytes.
    length: usize,
    /// Number of the last line, from 1, and where it starts.
    number: usize,
    start: usize,
    /// True if the text so far ends with a carriage return, which a line feed may follow.
    after_return: bool,
    /// Start and number of the lines that are neither blank nor comments, from the last place that was asked for.
    starts: VecDeque<(usize, usize)>,
    /// Where the preamble ends.
    origin: usize,
}

impl Default for Lines {
    fn default() -> Self {
        Self { length: 0, number: 1, start: 0, after_return: false, starts: VecDeque::new(), origin: 0 }
    }
}

impl Lines {
    /// Appends `more` to `text`; carriage returns, with a line feed or without, become line feeds.
    fn add(&mut self, more: &str, text: &mut Vec<u8>) {
        for part in more.split_inclusive(['\n', '\r']) {
            let is_second = mem::replace(&mut self.after_return, part.ends_with('\r')) && part == "\n";
            if is_second {
                continue;
            }
            if self.length == self.start && !part.starts_with(['\n', '\r', '#']) {
                self.starts.push_back((self.start, self.number));
            }
            let line = part.trim_end_matches(['\n', '\r']);
            text.extend_from_slice(line.as_bytes());
            self.length += line.len();
            if line.len() < part.len() {
                text.push(b'\n');
                self.length += 1;
                self.number += 1;
                self.start = self.length;
            }
        }
    }

    /// Forgets the lines that start before `place`.
    fn skip_to(&mut self, place: usize) {
        while self.starts.front().is_some_and(|(start, _)| *start < place) {
            self.starts.pop_front();
        }
    }
}

impl Source<'_> {
    /// Reads the whole text of a file in UTF-8, with or without byte order mark; its lines end with line feeds.
    ///
    /// # Errors
    /// [`BadInput`] with the line of a byte that is not UTF-8, if the file cannot be read or is too large, and for the other
    /// bounds of a table.
    pub fn utf_8(self) -> anyhow::Result<String> {
        let mut text = String::new();
        Stream::new(self.expect_utf_8()).read_to_string(&mut text).map_err(unwrapped)?;
        Ok(text)
    }
}

/// The message that a [`Stream`] has passed through an input/output error.
pub(super) fn unwrapped(error: std::io::Error) -> anyhow::Error {
    error.downcast::<BadInput>().map_or_else(anyhow::Error::from, anyhow::Error::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes without end that start with a header: the same row again and again.
    struct Endless {
        row: Vec<u8>,
        at: usize,
    }

    impl Read for Endless {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            for byte in &mut *buffer {
                *byte = self.row[self.at % self.row.len()];
                self.at += 1;
            }
            Ok(buffer.len())
        }
    }

    #[test]
    fn only_a_part_of_a_long_text_is_in_memory() {
        let row = format!("{}\r\n", "12,".repeat(300)).into_bytes();
        let mut stream = Stream::new(Source::read("r", io::BufReader::new(Endless { row, at: 0 })));
        assert_eq!(stream.skip_preamble().unwrap(), None);
        // No line is a header, so that all lines that may be titles are read ahead.
        assert_eq!(stream.skip_titles(None).unwrap(), (Separator::COMMA, None));
        let (mut buffer, mut most) = ([0; 8192], 0);
        for place in (0..64 << 20).step_by(buffer.len()) {
            stream.read_exact(&mut buffer).unwrap();
            assert!(stream.line_at(place as u64) > place / 901, "line numbers keep up");
            let lines = stream.lines.starts.capacity() * size_of::<(usize, usize)>();
            most = most.max(stream.text.capacity() + stream.raw.capacity() + lines);
        }
        assert!(most < 256 << 10, "{most} bytes in memory");
    }

    #[test]
    fn the_first_bound_that_is_exceeded_ends_the_stream() {
        for (row, expected) in [
            ("12345,", "r, line 1: longer than 1 MiB; expected a line of CSV"),
            (
                "1,2\n",
                "r: more than 1000000 lines; expected at most that: keep every tenth row, or a part of the record",
            ),
            ("\r", "r: more than 1000000 lines; expected at most that: keep every tenth row, or a part of the record"),
            (
                &format!("{}\n", "1".repeat(1 << 19)),
                "r: more than 512 MiB; expected at most that: keep every tenth row, or a part of the record",
            ),
        ] {
            let rows = Endless { row: row.as_bytes().to_vec(), at: 0 };
            let mut stream = Stream::new(Source::read("r", io::BufReader::with_capacity(CHUNK, rows)));
            let error = io::copy(&mut stream, &mut io::sink()).unwrap_err();
            assert_eq!(error.to_string(), expected);
        }
    }
}
