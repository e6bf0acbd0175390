//! Bytes in, lines out.

use crate::log::formats::{Encoding, Formats};
use crate::log::frames::{Frames, Packed};
use crate::log::line::Line;
use crate::log::shape::Stop;

/// Bytes that unpacking may leave behind a frame, all zero: the last seven are packed together.
const MOST_PADDING: usize = 6;

/// What a log is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A frame that could be read.
    Line(Line),
    /// Bytes that are no frame. Reading went on after them.
    Damaged {
        /// Place of the first in the stream.
        offset: u64,
        /// How many.
        bytes: u64,
    },
    /// A frame is damaged, and the encoding does not tell where the next one starts.
    Lost {
        /// Place of the frame in the stream.
        offset: u64,
    },
    /// At the end of the stream: all the bytes after [`Item::Lost`].
    Unread {
        /// How many.
        bytes: u64,
    },
    /// At the end of the stream: a frame that is not whole.
    CutOff {
        /// Place of its first byte in the stream.
        offset: u64,
        /// How many bytes of it are there.
        bytes: u64,
    },
}

/// Decodes a stream of frames as it comes.
pub struct Decoder {
    formats: Formats,
    frames: Frames,
    /// Where a raw stream stopped to make sense, and how many bytes came since.
    lost: Option<u64>,
}

impl Decoder {
    /// A decoder for the log of the firmware that the formats are from.
    pub fn new(formats: Formats) -> Self {
        Self { formats, frames: Frames::default(), lost: None }
    }

    /// How the frames are packed.
    pub fn encoding(&self) -> Encoding {
        self.formats.encoding()
    }

    /// All that is complete with the next `bytes` of the stream.
    pub fn feed(&mut self, bytes: &[u8]) -> Vec<Item> {
        if let Some(lost) = &mut self.lost {
            *lost += bytes.len() as u64;
            return Vec::new();
        }
        self.frames.push(bytes);
        match self.encoding() {
            Encoding::Raw => self.raw(),
            Encoding::Rzcobs => self.rzcobs(),
        }
    }

    /// What the end of the stream leaves.
    pub fn finish(self) -> Option<Item> {
        match (self.lost, self.frames.rest().len() as u64) {
            (Some(bytes), _) => Some(Item::Unread { bytes }),
            (None, 0) => None,
            (None, bytes) => Some(Item::CutOff { offset: self.frames.position(), bytes }),
        }
    }

    fn rzcobs(&mut self) -> Vec<Item> {
        let mut items = Vec::new();
        while let Some(Packed { offset, length, unpacked }) = self.frames.packed() {
            let line = unpacked.and_then(|bytes| {
                let (line, length) = self.formats.decode(&bytes).ok()?;
                let padding = &bytes[length..];
                (padding.len() <= MOST_PADDING && padding.iter().all(|&byte| byte == 0)).then_some(line)
            });
            items.push(line.map_or(Item::Damaged { offset, bytes: length }, Item::Line));
        }
        items
    }

    fn raw(&mut self) -> Vec<Item> {
        let mut items = Vec::new();
        loop {
            match self.formats.decode(self.frames.rest()) {
                Ok((line, length)) => {
                    self.frames.skip(length);
                    items.push(Item::Line(line));
                }
                Err(Stop::More) if !self.frames.is_too_long() => return items,
                Err(_) => {
                    self.lost = Some(self.frames.rest().len() as u64);
                    items.push(Item::Lost { offset: self.frames.position() });
                    return items;
                }
            }
        }
    }
}
