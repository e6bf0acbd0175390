//! Storage of a model in flash, safe against power cuts: two pages that are used alternately.
//!
//! ```text
//! page = mark (4 bytes), length (2), format (1), unused (1) | number (4), seal (4) | payload
//! seal = CRC-32C(all before it, CRC-32C(payload)); numbers low byte first
//! ```
//!
//! A new model is written to the unused page: the page is erased with the first part, written part by part, validated, and
//! sealed by its last word. Without that word the page is invalid, and the other page is not modified, so that a power cut at
//! any time preserves the old or the new model. Of two sealed pages, the one with the higher number is valid.

use link::wire_model::{MOST_BYTES, PART};
use link::{ModelId, Reason, frame};

/// Length of a page, in bytes: the smallest unit that can be erased.
pub const PAGE: usize = 2048;
/// Length of a word, in bytes: the smallest unit that can be written.
pub const WORD: usize = 8;

const HEADER: usize = 2 * WORD;
const MARK: u32 = u32::from_le_bytes(*b"vsjm");

const _: () = assert!(HEADER + MOST_BYTES <= PAGE && PART.is_multiple_of(WORD));

/// One of the two pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The first page.
    A,
    /// The second page.
    B,
}

impl Side {
    const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// The flash could not be erased or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashError;

/// Two pages of flash.
pub trait Pages {
    /// Content of a page.
    fn bytes(&self, side: Side) -> &[u8; PAGE];

    /// Runs `read`, which reads the pages, and tolerates words with uncorrectable bit errors, which a power cut can cause. Their
    /// content is undefined.
    fn tolerate_bit_errors<T>(&self, read: impl FnOnce() -> T) -> T {
        read()
    }

    /// Erases a page: sets all of its bytes to 0xff.
    ///
    /// # Errors
    /// [`FlashError`] if the hardware reports a failure.
    fn erase(&mut self, side: Side) -> Result<(), FlashError>;

    /// Writes an erased word at offset `at`, in bytes, a multiple of [`WORD`].
    ///
    /// # Errors
    /// [`FlashError`] if the hardware reports a failure.
    fn program(&mut self, side: Side, at: usize, word: [u8; WORD]) -> Result<(), FlashError>;
}

/// The model store.
#[derive(Debug)]
pub struct Store<P> {
    pages: P,
    /// Number of the next part of the transfer.
    expected: u8,
}

impl<P: Pages> Store<P> {
    /// A store on `pages` with any content.
    pub const fn new(pages: P) -> Self {
        Self { pages, expected: 0 }
    }

    /// The pages of the store.
    pub const fn pages(&self) -> &P {
        &self.pages
    }

    /// The valid model and its payload, if there is one.
    pub fn newest(&self) -> Option<(ModelId, &[u8])> {
        self.find().map(|(_, id, payload)| (id, payload))
    }

    /// Writes part `number` of a new model. Part 0 starts a new transfer.
    ///
    /// # Errors
    /// The [`Reason`] for rejecting the part.
    pub fn part(&mut self, number: u8, bytes: &[u8; PART]) -> Result<(), Reason> {
        let side = self.unused();
        let at = HEADER + PART * usize::from(number);
        if number != 0 && number != self.expected || at + PART > HEADER + MOST_BYTES {
            return Err(Reason::PartMissing(self.expected));
        }
        // After any failure the model has to be sent again.
        self.expected = 0;
        if number == 0 {
            self.pages.erase(side).map_err(not_stored)?;
        }
        for (at, word) in (at..).step_by(WORD).zip(bytes.as_chunks().0) {
            self.pages.program(side, at, *word).map_err(not_stored)?;
        }
        self.expected = number + 1;
        Ok(())
    }

    /// Seals the new model if its payload is complete and `check` accepts it.
    ///
    /// # Errors
    /// The [`Reason`] for rejecting the model; the old model remains valid.
    pub fn end(
        &mut self,
        length: u16,
        checksum: u32,
        check: impl FnOnce(&[u8]) -> Result<(), Reason>,
    ) -> Result<ModelId, Reason> {
        let expected = core::mem::take(&mut self.expected);
        if usize::from(length).div_ceil(PART) != usize::from(expected) || length == 0 {
            return Err(Reason::PartMissing(expected));
        }
        let side = self.unused();
        let number = self.newest().map_or(0, |(id, _)| id.number).wrapping_add(1);
        let payload = self.pages.bytes(side).get(HEADER..HEADER + usize::from(length)).ok_or(Reason::ModelDamaged)?;
        let id = ModelId::of(number, payload);
        if id.checksum != checksum {
            return Err(Reason::ModelDamaged);
        }
        check(payload)?;
        let [first, last] = header(&id);
        self.pages.program(side, 0, first).map_err(not_stored)?;
        self.pages.program(side, WORD, last).map_err(not_stored)?;
        match self.newest() {
            Some((stored, _)) if stored == id => Ok(id),
            _ => Err(Reason::NotStored),
        }
    }

    fn find(&self) -> Option<(Side, ModelId, &[u8])> {
        let found = |side| open(self.pages.bytes(side)).map(|(id, bytes)| (side, id, bytes));
        let [a, b] = self.pages.tolerate_bit_errors(|| [Side::A, Side::B].map(found));
        match (a, b) {
            (Some(a), Some(b)) => Some(if b.1.number > a.1.number { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    fn unused(&self) -> Side {
        self.find().map_or(Side::A, |(side, ..)| side.other())
    }
}

fn not_stored(_: FlashError) -> Reason {
    Reason::NotStored
}

fn header(id: &ModelId) -> [[u8; WORD]; 2] {
    let [m0, m1, m2, m3] = MARK.to_le_bytes();
    let [l0, l1] = id.length.to_le_bytes();
    let [n0, n1, n2, n3] = id.number.to_le_bytes();
    let [c0, c1, c2, c3] = id.checksum.to_le_bytes();
    let first = [m0, m1, m2, m3, l0, l1, id.format, 0];
    let seal = frame::checksum(&[m0, m1, m2, m3, l0, l1, id.format, 0, n0, n1, n2, n3, c0, c1, c2, c3]);
    let [s0, s1, s2, s3] = seal.to_le_bytes();
    [first, [n0, n1, n2, n3, s0, s1, s2, s3]]
}

/// The model and payload of a page, if it is sealed.
fn open(page: &[u8; PAGE]) -> Option<(ModelId, &[u8])> {
    let ([first, last], _) = page.as_chunks::<WORD>().0.split_first_chunk()?;
    let [n0, n1, n2, n3, ..] = *last;
    let [.., l0, l1, _, _] = *first;
    let length = usize::from(u16::from_le_bytes([l0, l1]));
    let payload = page.get(HEADER..HEADER + length)?;
    let id = ModelId::of(u32::from_le_bytes([n0, n1, n2, n3]), payload);
    (header(&id) == [*first, *last]).then_some((id, payload))
}

#[cfg(test)]
mod tests;
