//! Splits a stream of bytes into frames.

/// Longest frame, in bytes; anything longer is damaged and not stored.
const LONGEST: usize = 1 << 16;

/// Received bytes that are not decoded yet.
#[derive(Default)]
pub(super) struct Frames {
    buffer: Vec<u8>,
    /// Index in `buffer` of the first byte not decoded.
    start: usize,
    /// Index in `buffer` up to which the end mark was searched for.
    searched: usize,
    /// Position of `buffer[0]` in the stream.
    offset: u64,
}

/// The bytes between two end marks.
pub(super) struct Packed {
    pub(super) offset: u64,
    /// Number of bytes without the end mark.
    pub(super) length: u64,
    /// The unpacked frame; `None` if the packing is damaged.
    pub(super) unpacked: Option<Vec<u8>>,
}

impl Frames {
    pub(super) fn push(&mut self, bytes: &[u8]) {
        // Once per call instead of once per frame.
        self.buffer.drain(..self.start);
        self.offset += self.start as u64;
        self.searched = self.searched.saturating_sub(self.start);
        self.start = 0;
        self.buffer.extend_from_slice(bytes);
    }

    /// The next bytes that end with a mark or exceed the longest frame; `None` if incomplete.
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
            // Several marks may follow each other: each start of the firmware sends one.
            if length > 0 {
                return Some(Packed { offset, length, unpacked });
            }
        }
    }

    /// Bytes not decoded yet.
    pub(super) fn rest(&self) -> &[u8] {
        &self.buffer[self.start..]
    }

    /// Position of [`rest`](Self::rest) in the stream.
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
