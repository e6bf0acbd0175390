//! Bytes to checked packets.
//!
//! Everything between two delimiters is one candidate. It is taken only if it fits, decodes and has a sound CRC; if not, it
//! is dropped and counted, and the next delimiter starts anew. Damage therefore never costs a frame that it did not touch.

use crate::frame::{DELIMITER, MAX_ENCODED, Packet};

/// A receiver with a fixed buffer.
#[derive(Clone, Debug)]
pub struct Receiver {
    buffer: [u8; MAX_ENCODED],
    /// Bytes since the last delimiter; beyond the buffer's size it says that the frame is lost.
    length: usize,
    damaged: u32,
    oversize: u32,
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

impl Receiver {
    /// A receiver that has heard nothing.
    pub const fn new() -> Self {
        Self { buffer: [0; MAX_ENCODED], length: 0, damaged: 0, oversize: 0 }
    }

    /// Takes a byte; the last one of a sound frame gives its packet.
    pub fn on_byte(&mut self, byte: u8) -> Option<Packet<'_>> {
        if byte != DELIMITER {
            if let Some(place) = self.buffer.get_mut(self.length) {
                *place = byte;
            }
            // One past the buffer is enough to know, and cannot wrap.
            self.length = (self.length + 1).min(MAX_ENCODED + 1);
            return None;
        }
        let length = core::mem::take(&mut self.length);
        if length == 0 {
            return None;
        }
        match self.buffer.get_mut(..length) {
            None => {
                self.oversize = self.oversize.saturating_add(1);
                None
            }
            Some(encoded) => {
                let packet = Packet::open(encoded);
                if packet.is_none() {
                    self.damaged = self.damaged.saturating_add(1);
                }
                packet
            }
        }
    }

    /// Candidates that did not decode or whose CRC was wrong.
    pub fn damaged(&self) -> u32 {
        self.damaged
    }

    /// Candidates that were longer than any frame.
    pub fn oversize(&self) -> u32 {
        self.oversize
    }
}
