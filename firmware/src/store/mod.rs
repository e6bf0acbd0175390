//! Storage of a model and of settings in flash, safe against power cuts: two pages for each, which are used alternately.
//!
//! ```text
//! page = mark (4 bytes), length (2), format (1), unused (1) | number (4), seal (4) | payload
//! seal = CRC-32C(all before it, CRC-32C(payload)); numbers low byte first
//! ```
//!
//! A new block is written to its unused page: the page is erased with the first part, written part by part, validated, and
//! sealed by its last word. Without that word the page is invalid, and the other page is not modified, so that a power cut at
//! any time preserves the old or the new block. Of two sealed pages, the one with the higher number is valid.

mod memory;

pub use memory::Memory;

use link::block::PART;
use link::wire_model::MOST_BYTES;
use link::{Block, BlockId, Reason, frame};

/// Length of a page, in bytes: the smallest unit that can be erased.
pub const PAGE: usize = 2048;
/// Length of a word, in bytes: the smallest unit that can be written.
pub const WORD: usize = 8;

/// Number of pages: two for each block.
pub const PAGES: usize = 4;

const HEADER: usize = 2 * WORD;

const _: () = assert!(HEADER + MOST_BYTES <= PAGE && PART.is_multiple_of(WORD));

/// One of the two pages of a block.
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

/// A page: one of the two of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Page {
    /// Block that the page holds.
    pub block: Block,
    /// Which of the block's two pages it is.
    pub side: Side,
}

impl Page {
    /// Every page.
    pub const ALL: [Self; PAGES] = [
        Self { block: Block::Model, side: Side::A },
        Self { block: Block::Model, side: Side::B },
        Self { block: Block::Settings, side: Side::A },
        Self { block: Block::Settings, side: Side::B },
    ];

    /// Index in [`Page::ALL`].
    pub const fn index(self) -> usize {
        2 * self.block as usize + self.side as usize
    }
}

/// The flash could not be erased or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashError;

/// The pages of flash.
pub trait Pages {
    /// Content of a page.
    fn bytes(&self, page: Page) -> &[u8; PAGE];

    /// Runs `read`, which reads the pages, and tolerates words with uncorrectable bit errors, which a power cut can cause. Their
    /// content is undefined.
    fn tolerate_bit_errors<T>(&self, read: impl FnOnce() -> T) -> T {
        read()
    }

    /// Erases a page: sets all of its bytes to 0xff.
    ///
    /// # Errors
    /// [`FlashError`] if the hardware reports a failure.
    fn erase(&mut self, page: Page) -> Result<(), FlashError>;

    /// Writes an erased word at offset `at`, in bytes, a multiple of [`WORD`].
    ///
    /// # Errors
    /// [`FlashError`] if the hardware reports a failure.
    fn program(&mut self, page: Page, at: usize, word: [u8; WORD]) -> Result<(), FlashError>;
}

/// The store.
#[derive(Debug)]
pub struct Store<P> {
    pages: P,
    /// Block of the transfer.
    block: Block,
    /// Number of the next part of the transfer.
    expected: u8,
}

impl<P: Pages> Store<P> {
    /// A store on `pages` with any content.
    pub const fn new(pages: P) -> Self {
        Self { pages, block: Block::Model, expected: 0 }
    }

    /// The pages of the store.
    pub const fn pages(&self) -> &P {
        &self.pages
    }

    /// The valid content of a block and its payload, if there is one.
    pub fn newest(&self, block: Block) -> Option<(BlockId, &[u8])> {
        self.find(block).map(|(_, id, payload)| (id, payload))
    }

    /// Whether the newest content of a block was sealed and is damaged now, so that an older one is valid, or none. After a power
    /// cut in the last word of a page, or while one is erased, it cannot be known, and may count as damaged; an erased page and one
    /// of another program do not.
    pub fn is_damaged(&self, block: Block) -> bool {
        self.damaged(block).is_some()
    }

    /// Writes part `number` of a block's new content. Part 0 starts a new transfer; one of another block ends there.
    ///
    /// # Errors
    /// The [`Reason`] for rejecting the part.
    pub fn part(&mut self, block: Block, number: u8, bytes: &[u8; PART]) -> Result<(), Reason> {
        let expected = self.take_expected(block);
        let page = self.unused(block);
        let at = HEADER + PART * usize::from(number);
        if number != 0 && number != expected || at + PART > HEADER + MOST_BYTES {
            self.expected = expected;
            return Err(Reason::PartMissing(expected));
        }
        // After any failure all parts have to be sent again.
        if number == 0 {
            self.pages.erase(page).map_err(not_stored)?;
        }
        for (at, word) in (at..).step_by(WORD).zip(bytes.as_chunks().0) {
            self.pages.program(page, at, *word).map_err(not_stored)?;
        }
        self.expected = number + 1;
        Ok(())
    }

    /// Seals a block's new content if its payload is complete and `check` accepts it. If none was valid before, its number is above that of
    /// the damaged page, which may be valid again if its weak bits read right, and that page is erased.
    ///
    /// # Errors
    /// The [`Reason`] for rejecting the content; the old one remains valid.
    pub fn end(
        &mut self,
        block: Block,
        length: u16,
        checksum: u32,
        check: impl FnOnce(&Self, &[u8]) -> Result<(), Reason>,
    ) -> Result<BlockId, Reason> {
        let expected = self.take_expected(block);
        if usize::from(length).div_ceil(PART) != usize::from(expected) || length == 0 {
            return Err(Reason::PartMissing(expected));
        }
        let page = self.unused(block);
        let old = self.newest(block).map(|(id, _)| id.number);
        let number = old.or_else(|| self.damaged_number(block)).unwrap_or(0).wrapping_add(1);
        // Its words have not been read before: a bad one is a checksum that is not the host's.
        let written = self.pages.tolerate_bit_errors(|| {
            let payload = self.pages.bytes(page).get(HEADER..HEADER + usize::from(length))?;
            Some((BlockId::of(number, payload), payload))
        });
        let (id, payload) = written.ok_or(Reason::Damaged)?;
        if id.checksum != checksum {
            return Err(Reason::Damaged);
        }
        check(self, payload)?;
        let [first, last] = header(block, &id);
        self.pages.program(page, 0, first).map_err(not_stored)?;
        self.pages.program(page, WORD, last).map_err(not_stored)?;
        match self.newest(block) {
            Some((stored, _)) if stored == id => {
                if old.is_none() {
                    // The new content is the newest whether or not this succeeds.
                    let _ = self.pages.erase(Page { block, side: page.side.other() });
                }
                Ok(id)
            }
            _ => Err(Reason::NotStored),
        }
    }

    /// Number of the next part of `block`, 0 if the transfer is one of another block. The transfer ends.
    fn take_expected(&mut self, block: Block) -> u8 {
        let expected = core::mem::take(&mut self.expected);
        if core::mem::replace(&mut self.block, block) == block { expected } else { 0 }
    }

    fn find(&self, block: Block) -> Option<(Side, BlockId, &[u8])> {
        let found = |side| open(block, self.pages.bytes(Page { block, side })).map(|(id, bytes)| (side, id, bytes));
        let [a, b] = self.pages.tolerate_bit_errors(|| [Side::A, Side::B].map(found));
        match (a, b) {
            (Some(a), Some(b)) => Some(if b.1.number > a.1.number { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// The damaged page of [`Store::is_damaged`].
    fn damaged(&self, block: Block) -> Option<Side> {
        let newest = self.newest(block).map(|(id, _)| id.number);
        let is_damaged = |side: &Side| was_sealed(block, self.pages.bytes(Page { block, side: *side }), newest);
        self.pages.tolerate_bit_errors(|| [Side::A, Side::B].into_iter().find(is_damaged))
    }

    /// The number in the damaged page of a block.
    fn damaged_number(&self, block: Block) -> Option<u32> {
        let page = Page { block, side: self.damaged(block)? };
        self.pages.tolerate_bit_errors(|| number(self.pages.bytes(page)))
    }

    /// The page for new content. A damaged one stays until the new content is sealed, so that a power cut does not hide the damage;
    /// what is valid beside it does not drive the output any more.
    fn unused(&self, block: Block) -> Page {
        let kept = self.damaged(block).or(self.find(block).map(|(side, ..)| side));
        Page { block, side: kept.map_or(Side::A, Side::other) }
    }
}

/// Most wrong bits of a mark that is taken for a damaged one. The marks of the two blocks differ in four, and an erased page in more.
const WRONG_BITS: u32 = 3;

/// What a page begins with: a page of one block is none of the other.
const fn mark(block: Block) -> [u8; 4] {
    match block {
        Block::Model => *b"vsjm",
        Block::Settings => *b"vsjs",
    }
}

fn not_stored(_: FlashError) -> Reason {
    Reason::NotStored
}

fn header(block: Block, id: &BlockId) -> [[u8; WORD]; 2] {
    let [m0, m1, m2, m3] = mark(block);
    let [l0, l1] = id.length.to_le_bytes();
    let [n0, n1, n2, n3] = id.number.to_le_bytes();
    let [c0, c1, c2, c3] = id.checksum.to_le_bytes();
    let first = [m0, m1, m2, m3, l0, l1, id.format, 0];
    let seal = frame::checksum(&[m0, m1, m2, m3, l0, l1, id.format, 0, n0, n1, n2, n3, c0, c1, c2, c3]);
    let [s0, s1, s2, s3] = seal.to_le_bytes();
    [first, [n0, n1, n2, n3, s0, s1, s2, s3]]
}

/// The content and payload of a block's page, if it is sealed.
fn open(block: Block, page: &[u8; PAGE]) -> Option<(BlockId, &[u8])> {
    open_as(block, page, number(page)?)
}

/// The number in a page, whether it is sealed or not.
fn number(page: &[u8; PAGE]) -> Option<u32> {
    page.get(WORD..)?.first_chunk().copied().map(u32::from_le_bytes)
}

/// The content and payload of a block's page, if it was sealed with this number.
fn open_as(block: Block, page: &[u8; PAGE], number: u32) -> Option<(BlockId, &[u8])> {
    let ([first, [_, _, _, _, seal @ ..]], _) = page.as_chunks::<WORD>().0.split_first_chunk()?;
    let [.., l0, l1, _, _] = *first;
    let length = usize::from(u16::from_le_bytes([l0, l1]));
    let payload = page.get(HEADER..HEADER + length)?;
    let id = BlockId::of(number, payload);
    let [is, [_, _, _, _, sealed @ ..]] = header(block, &id);
    (is == *first && sealed == *seal).then_some((id, payload))
}

/// Whether a block's page that is not valid was sealed with content newer than that with the number `newest`, the valid one.
fn was_sealed(block: Block, page: &[u8; PAGE], newest: Option<u32>) -> bool {
    let Some(([first, last], _)) = page.as_chunks::<WORD>().0.split_first_chunk() else { return false };
    let wrong_bits: u32 = first.iter().zip(mark(block)).map(|(is, should)| (is ^ should).count_ones()).sum();
    if *last == [0xff; WORD] || wrong_bits > WRONG_BITS || open(block, page).is_some() {
        return false;
    }
    // A page with a smaller number is one whose erasure a power cut has interrupted, unless it is right with the next number.
    let Some(next) = newest.map(|newest| newest.wrapping_add(1)) else { return true };
    last.starts_with(&next.to_le_bytes()) || open_as(block, page, next).is_some()
}

#[cfg(test)]
mod tests;
