//! Where frames start and end in a stream of bytes.

/// Longest frame in bytes; what is longer is damaged, and need not be kept.
const LONGEST: usize = 1 << 16;

/// Bytes that have come and are not read yet.
#[derive(Default)]
pub(super) struct Frames {
    buffer: Vec<u8>,
    /// Start of what is not read, in `buffer`.
    start: usize,
    /// How far the search for a mark got.
    searched: usize,
    /// Place of `buffer[0]` in the stream.
    offset: u64,
}

/// A stretch of the stream between two marks.
pub(super) struct Packed {
    pub(super) offset: u64,
    /// Without its mark.
    pub(super) length: u64,
    /// Nothing if the packing itself is broken.
    pub(super) unpacked: Option<Vec<u8>>,
}

impl Frames {
    pub(super) fn push(&mut self, bytes: &[u8]) {
        // Once a call, not once a frame.
        self.buffer.drain(..self.start);
        self.offset += self.start as u64;
        self.searched = self.searched.saturating_sub(self.start);
        self.start = 0;
        self.buffer.extend_from_slice(bytes);
    }

    /// The next stretch that is ended by a mark, or too long for a frame.
    pub(super) fn packed(&mut self) -> Option<Packed> {
        loop {
            let from = self.searched.max(self.start);
            let mark = self.buffer[from..].iter().position(|&byte| byte == 0).map(|found| from + found);
            let end = match mark {
                Some(mark) => mark,
                None if self.rest().len() > LONGEST => self.buffer.len(),
                None => {
                    self.searched = self.buffer.len();
                    return None;
                }
            };
            let offset = self.position();
            let packed = &self.buffer[self.start..end];
            let length = packed.len() as u64;
            let unpacked = if mark.is_some() { rzcobs::decode(packed).ok() } else { None };
            self.start = end + usize::from(mark.is_some());
            self.searched = self.start;
            // Marks in a row: each start of the firmware sends one.
            if length > 0 {
                return Some(Packed { offset, length, unpacked });
            }
        }
    }

    /// What is not read yet.
    pub(super) fn rest(&self) -> &[u8] {
        &self.buffer[self.start..]
    }

    /// Place of [`rest`](Self::rest) in the stream.
    pub(super) fn position(&self) -> u64 {
        self.offset + self.start as u64
    }

    pub(super) fn skip(&mut self, length: usize) {
        self.start += length;
    }

    pub(super) fn is_too_long(&self) -> bool {
        self.rest().len() > LONGEST
    }
}
