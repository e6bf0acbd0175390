//! Decodes a stream of bytes into lines.

use crate::log::formats::{Encoding, Formats};
use crate::log::frames::{Frames, Packed};
use crate::log::line::Line;
use crate::log::shape::Stop;

/// Bytes that unpacking may append to a frame, all zero, because seven bytes are packed together.
const MOST_PADDING: usize = 6;

/// A part of a log.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A decoded frame.
    Line(Line),
    /// Bytes that are not a valid frame; decoding continues after them.
    Damaged {
        /// Position of the first byte in the stream.
        offset: u64,
        /// Number of bytes.
        bytes: u64,
    },
    /// A damaged frame of an encoding that does not mark where the next frame starts.
    Lost {
        /// Position of the frame in the stream.
        offset: u64,
    },
    /// The bytes after [`Item::Lost`], reported at the end of the stream.
    Unread {
        /// Number of bytes.
        bytes: u64,
    },
    /// An incomplete frame at the end of the stream.
    CutOff {
        /// Position of its first byte in the stream.
        offset: u64,
        /// Number of its bytes that exist.
        bytes: u64,
    },
}

/// Decodes a stream of frames while it arrives.
pub struct Decoder {
    formats: Formats,
    frames: Frames,
    /// Position of the first damaged frame of a raw stream, from which nothing can be decoded.
    lost: Option<u64>,
}

impl Decoder {
    /// Creates a decoder for logs of the firmware that the formats belong to.
    pub fn new(formats: Formats) -> Self {
        Self { formats, frames: Frames::default(), lost: None }
    }

    /// Encoding of the frames.
    pub fn encoding(&self) -> Encoding {
        self.formats.encoding()
    }

    /// Adds bytes; returns all items that they complete.
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

    /// Ends the stream; returns what remains.
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
