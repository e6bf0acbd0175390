//! Bytes in, packets with a correct CRC out.
//!
//! The bytes between two delimiters are one candidate. It is dropped and counted if it is too long, does not decode or has a
//! wrong CRC; the next delimiter starts the next candidate. Corrupted bytes therefore affect only the frame they are in.

use crate::frame::{DELIMITER, MAX_ENCODED, Packet};

/// Decoder of the byte stream, with a buffer for one frame.
#[derive(Clone, Debug)]
pub struct Receiver {
    buffer: [u8; MAX_ENCODED],
    /// Number of bytes since the last delimiter, limited to one more than the buffer holds: then the frame is lost.
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
    /// A receiver in its initial state, with all counters at zero.
    pub const fn new() -> Self {
        Self { buffer: [0; MAX_ENCODED], length: 0, damaged: 0, oversize: 0 }
    }

    /// Processes the next byte and returns the packet that it completes, if any.
    pub fn on_byte(&mut self, byte: u8) -> Option<Packet<'_>> {
        if byte != DELIMITER {
            if let Some(place) = self.buffer.get_mut(self.length) {
                *place = byte;
            }
            // Saturates, so that the counter cannot overflow.
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

    /// Number of candidates that did not decode or had a wrong CRC.
    pub fn damaged(&self) -> u32 {
        self.damaged
    }

    /// Number of candidates longer than [`MAX_ENCODED`] bytes.
    pub fn oversize(&self) -> u32 {
        self.oversize
    }
}
