//! Power cuts at every step of storing a model or settings, with eight ways of interrupting the step.

use std::cell::Cell;
use std::vec::Vec;

use link::Block::{Model, Settings};
use link::wire_model::MOST_PARTS;
use random_numbers::Xorshift32;

use super::*;

mod other_store;

/// Simulated flash with a power cut.
#[derive(Clone, Debug)]
struct Flash {
    pages: [[u8; PAGE]; PAGES],
    /// Number of steps until the power cut; `None` without one.
    steps: Option<usize>,
    torn: Torn,
}

/// Effect of the step that the power cut interrupts.
#[derive(Clone, Copy, Debug)]
enum Torn {
    /// No bit is changed.
    Nothing,
    /// All bits are changed.
    All,
    /// The bits of this pattern are changed.
    Some(u64),
}

const TORN: [Torn; 8] = [
    Torn::Nothing,
    Torn::All,
    Torn::Some(0x5555_5555_5555_5555),
    Torn::Some(0xaaaa_aaaa_aaaa_aaaa),
    Torn::Some(0x0000_0000_ffff_ffff),
    Torn::Some(0xffff_ffff_0000_0000),
    Torn::Some(0x0123_4567_89ab_cdef),
    Torn::Some(0x8000_0000_0000_0001),
];

impl Flash {
    const BLANK: Self = Self { pages: [[0xff; PAGE]; PAGES], steps: None, torn: Torn::Nothing };

    /// The bits that this step changes, and whether the power is still on after it.
    fn power(&mut self) -> Result<(u64, bool), FlashError> {
        match &mut self.steps {
            None => Ok((u64::MAX, true)),
            Some(0) => Err(FlashError),
            Some(steps) => {
                *steps -= 1;
                let done = match (*steps, self.torn) {
                    (1.., _) | (0, Torn::All) => u64::MAX,
                    (0, Torn::Nothing) => 0,
                    (0, Torn::Some(bits)) => bits,
                };
                Ok((done, *steps > 0))
            }
        }
    }
}

impl Pages for Flash {
    fn bytes(&self, page: Page) -> &[u8; PAGE] {
        &self.pages[page.index()]
    }

    fn erase(&mut self, page: Page) -> Result<(), FlashError> {
        let (done, whole) = self.power()?;
        for word in self.pages[page.index()].as_chunks_mut::<WORD>().0 {
            *word = (u64::from_le_bytes(*word) | done).to_le_bytes();
        }
        if whole { Ok(()) } else { Err(FlashError) }
    }

    fn program(&mut self, page: Page, at: usize, word: [u8; WORD]) -> Result<(), FlashError> {
        let (done, whole) = self.power()?;
        let place = &mut self.pages[page.index()].as_chunks_mut::<WORD>().0[at / WORD];
        assert!(*place == [0xff; WORD] || self.steps.is_some(), "a word is written only once");
        *place = (u64::from_le_bytes(*place) & (u64::from_le_bytes(word) | !done)).to_le_bytes();
        if whole { Ok(()) } else { Err(FlashError) }
    }
}

fn payload(seed: u8) -> Vec<u8> {
    (0..100 + u32::from(seed)).map(|i| (i as u8).wrapping_mul(31).wrapping_add(seed)).collect()
}

fn store(flash: &Flash, payload: &[u8], check: Result<(), Reason>) -> (Flash, Result<BlockId, Reason>) {
    store_block(flash, Model, payload, check)
}

fn store_block(
    flash: &Flash,
    block: Block,
    payload: &[u8],
    check: Result<(), Reason>,
) -> (Flash, Result<BlockId, Reason>) {
    let mut store = Store::new(flash.clone());
    let mut sent = Ok(());
    for (number, part) in (0..).zip(payload.chunks(PART)) {
        let mut bytes = [0; PART];
        bytes[..part.len()].copy_from_slice(part);
        sent = sent.and_then(|()| store.part(block, number, &bytes));
    }
    let ended = sent.and_then(|()| store.end(block, payload.len() as u16, frame::checksum(payload), |_, _| check));
    (store.pages, ended)
}

fn newest(flash: &Flash) -> Option<Vec<u8>> {
    newest_block(flash, Model)
}

fn newest_block(flash: &Flash, block: Block) -> Option<Vec<u8>> {
    Store::new(flash.clone()).newest(block).map(|(_, payload)| payload.to_vec())
}

fn is_damaged(flash: &Flash, block: Block) -> bool {
    Store::new(flash.clone()).is_damaged(block)
}

/// Every single bit of a sealed page: with it wrong, the content before is valid, or none, and that is known.
#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_damaged_page_is_neither_valid_nor_taken_for_an_erased_one() {
    let (first, _) = store_block(&Flash::BLANK, Settings, &payload(1), Ok(()));
    let (second, _) = store_block(&first, Settings, &payload(2), Ok(()));
    for (flash, page, old) in [(&first, 2, None), (&second, 3, Some(payload(1)))] {
        assert!(!is_damaged(flash, Settings) && !is_damaged(flash, Model));
        let end = 8 * (HEADER + newest_block(flash, Settings).unwrap().len());
        for bit in 0..end {
            let mut damaged = flash.clone();
            damaged.pages[page][bit / 8] ^= 1 << (bit % 8);
            assert_eq!(newest_block(&damaged, Settings), old, "bit {bit}");
            assert!(is_damaged(&damaged, Settings), "bit {bit}");
            assert!(!is_damaged(&damaged, Model));
        }
    }
    let zeros = Flash { pages: [[0; PAGE]; PAGES], ..Flash::BLANK };
    for flash in [Flash::BLANK, zeros] {
        assert!(!is_damaged(&flash, Settings) && !is_damaged(&flash, Model), "nothing was stored");
    }
}

/// Three bits of the mark and all of the number, or of the payload.
#[test]
fn several_wrong_bits_of_mark_and_number_are_damage_and_a_foreign_mark_is_none() {
    let (first, _) = store_block(&Flash::BLANK, Settings, &payload(1), Ok(()));
    let (second, _) = store_block(&first, Settings, &payload(2), Ok(()));
    for (at, wrong, found) in [(0, 0x07, true), (WORD, 0xff, true), (HEADER, 0xff, true), (0, 0x0f, false)] {
        for (flash, page) in [(&first, 2), (&second, 3)] {
            let mut damaged = flash.clone();
            damaged.pages[page][at] ^= wrong;
            assert_eq!(is_damaged(&damaged, Settings), found, "{wrong:#x} at {at} of page {page}");
        }
    }
}

/// A transfer is cut off at each of its steps: until the new settings are valid, the next start finds the damage.
#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_transfer_that_is_cut_off_hides_no_damage() {
    let new = payload(9);
    for stored in 1..=3 {
        let mut flash =
            (1..=stored).fold(Flash::BLANK, |flash, of| store_block(&flash, Settings, &payload(of), Ok(())).0);
        let side = if stored % 2 == 1 { Side::A } else { Side::B };
        flash.pages[Page { block: Settings, side }.index()][HEADER] ^= 1;
        let steps = 1 + new.len().div_ceil(PART) * PART / WORD + 2;
        for (cut, torn) in (1..=steps).flat_map(|cut| TORN.map(|torn| (cut, torn))) {
            let until = Flash { steps: Some(cut), torn, ..flash.clone() };
            let again = Flash { steps: None, ..store_block(&until, Settings, &new, Ok(())).0 };
            let is_new = newest_block(&again, Settings).as_ref() == Some(&new);
            assert!(is_new || is_damaged(&again, Settings), "of {stored}, step {cut}, {torn:?}");
        }
        let (after, _) = store_block(&flash, Settings, &new, Ok(()));
        assert_eq!((newest_block(&after, Settings).as_ref(), is_damaged(&after, Settings)), (Some(&new), false));
    }
}

/// The page of the newest settings loses a bit while the other one is erased. The damaged page is erased after the new content is sealed,
/// which a power cut may prevent.
#[test]
fn settings_that_are_stored_after_damage_are_the_newest_for_good() {
    let new = payload(9);
    for newest in [2, 4] {
        let flash = (1..=newest).fold(Flash::BLANK, |flash, of| store_block(&flash, Settings, &payload(of), Ok(())).0);
        let mut store = Store::new(flash);
        store.part(Settings, 0, &[0; PART]).unwrap();
        let sealed = Page { block: Settings, side: Side::B }.index();
        let mut flash = store.pages;
        flash.pages[sealed][HEADER] ^= 1;
        assert!(is_damaged(&flash, Settings) && newest_block(&flash, Settings).is_none());
        let last_erase = 1 + new.len().div_ceil(PART) * PART / WORD + 2 + 1;
        let cuts = TORN.map(|torn| (Some(last_erase), torn));
        for (steps, torn) in cuts.into_iter().chain([(Some(last_erase - 1), Torn::All), (None, Torn::All)]) {
            let (after, stored) = store_block(&Flash { steps, torn, ..flash.clone() }, Settings, &new, Ok(()));
            assert!(stored.is_ok() || steps == Some(last_erase - 1), "{newest} {steps:?} {torn:?}: {stored:?}");
            let mut after = Flash { steps: None, ..after };
            assert_eq!(newest_block(&after, Settings).as_ref(), Some(&new), "{newest} {steps:?} {torn:?}");
            assert!(!is_damaged(&after, Settings), "{newest} {steps:?} {torn:?}");
            // The bit reads right again.
            after.pages[sealed][HEADER] ^= 1;
            assert_eq!(newest_block(&after, Settings).as_ref(), Some(&new), "{newest} {steps:?} {torn:?}");
            assert!(!is_damaged(&after, Settings), "{newest} {steps:?} {torn:?}");
        }
    }
}

/// Flash whose words may all be bad: to read one outside of `tolerate_bit_errors` stops the program.
struct Weak {
    flash: Flash,
    tolerates: Cell<bool>,
}

impl Pages for Weak {
    fn bytes(&self, page: Page) -> &[u8; PAGE] {
        assert!(self.tolerates.get(), "a read that is not tolerant");
        self.flash.bytes(page)
    }

    fn tolerate_bit_errors<T>(&self, read: impl FnOnce() -> T) -> T {
        assert!(!self.tolerates.replace(true), "the end of the inner one would end the outer one");
        let result = read();
        self.tolerates.set(false);
        result
    }

    fn erase(&mut self, page: Page) -> Result<(), FlashError> {
        self.flash.erase(page)
    }

    fn program(&mut self, page: Page, at: usize, word: [u8; WORD]) -> Result<(), FlashError> {
        self.flash.program(page, at, word)
    }
}

#[test]
fn every_read_of_a_page_tolerates_bad_words() {
    let mut store = Store::new(Weak { flash: Flash::BLANK, tolerates: Cell::new(false) });
    for seed in 1..4 {
        let (payload, mut bytes) = (payload(seed), [0; PART]);
        for (number, part) in (0..).zip(payload.chunks(PART)) {
            bytes[..part.len()].copy_from_slice(part);
            store.part(Settings, number, &bytes).unwrap();
        }
        let length = payload.len() as u16;
        assert!(store.end(Settings, length, frame::checksum(&payload), |_, _| Ok(())).is_ok());
        assert!(store.newest(Settings).is_some() && !store.is_damaged(Settings));
        // From the second round on, beside a page with a wrong bit.
        store.pages.flash.pages[Page { block: Settings, side: Side::A }.index()][HEADER] ^= 1;
    }
}

#[test]
fn the_model_with_the_highest_number_is_valid() {
    let mut flash = Flash::BLANK;
    assert_eq!(newest(&flash), None);
    for number in 1..6 {
        let (after, stored) = store(&flash, &payload(number), Ok(()));
        assert_eq!(stored.unwrap().number, u32::from(number));
        assert_eq!(newest(&after), Some(payload(number)));
        flash = after;
    }
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_power_cut_preserves_the_old_or_the_new_block() {
    let (mut cuts, mut old_ones, mut new_ones) = (0, 0, 0);
    for (block, other) in [(Model, Settings), (Settings, Model)] {
        // The other block has a content that no cut may touch.
        let kept = payload(9);
        let mut before = store_block(&Flash::BLANK, other, &kept, Ok(())).0;
        for number in 1..4 {
            let (old, new) = (newest_block(&before, block), payload(number));
            let (after, _) = store_block(&before, block, &new, Ok(()));
            // One erase, the words of the parts, and two words of the header.
            let steps = 1 + new.len().div_ceil(PART) * PART / WORD + 2;
            for (cut, torn) in (1..=steps).flat_map(|cut| TORN.map(|torn| (cut, torn))) {
                let until = Flash { steps: Some(cut), torn, ..before.clone() };
                let (cut_off, stored) = store_block(&until, block, &new, Ok(()));
                assert!(stored.is_err(), "success is never reported after a power cut");
                let again = Flash { steps: None, ..cut_off };
                let found = newest_block(&again, block);
                assert!(found == old || found.as_ref() == Some(&new), "step {cut}, {torn:?}: {found:?}");
                assert!(cut == steps || found == old, "only the last step makes the new block valid");
                assert_eq!(newest_block(&again, other).as_ref(), Some(&kept), "step {cut}, {torn:?}: the other block");
                assert!(
                    !is_damaged(&again, block) || cut == steps,
                    "step {cut}, {torn:?}: only the last word is unclear"
                );
                assert!(!is_damaged(&again, other), "step {cut}, {torn:?}");
                (cuts, old_ones, new_ones) =
                    (cuts + 1, old_ones + u32::from(found == old), new_ones + u32::from(found != old));
                // The next attempt succeeds.
                let (repaired, stored) = store_block(&again, block, &new, Ok(()));
                assert!(
                    stored.is_ok()
                        && newest_block(&repaired, block).as_ref() == Some(&new)
                        && !is_damaged(&repaired, block),
                    "step {cut}, {torn:?}"
                );
            }
            before = after;
        }
    }
    std::println!("count: {cuts} power cuts while a block is written, the old or the new one found each time");
    assert!(cuts > 800 && new_ones >= 6 && old_ones > new_ones, "{cuts} {old_ones} {new_ones}");
}

#[test]
fn a_transfer_of_one_block_ends_that_of_the_other() {
    let mut store = Store::new(Flash::BLANK);
    store.part(Model, 0, &[0; PART]).unwrap();
    assert_eq!(store.part(Settings, 1, &[0; PART]), Err(Reason::PartMissing(0)), "of another block");
    assert_eq!(store.part(Model, 1, &[0; PART]), Err(Reason::PartMissing(0)), "the transfer has ended");
    store.part(Model, 0, &[0; PART]).unwrap();
    assert_eq!(store.end(Settings, 20, 0, |_, _| Ok(())), Err(Reason::PartMissing(0)));
    assert_eq!(store.end(Model, 20, 0, |_, _| Ok(())), Err(Reason::PartMissing(0)));
}

/// A page of settings in the place of a model is none.
#[test]
fn a_page_of_one_block_is_none_of_the_other() {
    let (mut flash, _) = store_block(&Flash::BLANK, Settings, &payload(1), Ok(()));
    let [a, _, c, _] = &mut flash.pages;
    a.copy_from_slice(c);
    assert_eq!((newest_block(&flash, Model), newest_block(&flash, Settings)), (None, Some(payload(1))));
    assert!(!is_damaged(&flash, Model), "nor a damaged one");
}

#[test]
fn an_invalid_or_incomplete_model_is_not_stored() {
    let (flash, _) = store(&Flash::BLANK, &payload(1), Ok(()));
    let bad = Reason::Damaged;
    let (after, stored) = store(&flash, &payload(2), Err(bad));
    assert_eq!((stored, newest(&after)), (Err(bad), Some(payload(1))), "rejected by its validation");

    let mut store = Store::new(flash);
    assert_eq!(store.part(Model, 1, &[0; PART]), Err(Reason::PartMissing(0)), "the first part is missing");
    store.part(Model, 0, &[0; PART]).unwrap();
    assert_eq!(store.part(Model, 2, &[0; PART]), Err(Reason::PartMissing(1)), "a part is missing");
    assert_eq!(store.part(Model, 13, &[0; PART]), Err(Reason::PartMissing(1)), "beyond the longest payload");
    assert_eq!(store.end(Model, 40, 0, |_, _| Ok(())), Err(Reason::PartMissing(1)), "the end is missing");
    store.part(Model, 0, &[0; PART]).unwrap();
    assert_eq!(store.end(Model, 20, 1, |_, _| Ok(())), Err(Reason::Damaged), "another checksum");
    assert_eq!(store.end(Model, 20, 1, |_, _| Ok(())), Err(Reason::PartMissing(0)), "an end without parts");
    assert_eq!(store.newest(Model).map(|(id, _)| id.number), Some(1));
}

/// Random bits in a page cause neither a panic nor a valid model.
#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn random_pages_contain_no_model() {
    let mut numbers = Xorshift32::new(1);
    for round in 0..200 {
        let mut flash = Flash::BLANK;
        for byte in flash.pages.iter_mut().flatten() {
            *byte = numbers.draw() as u8;
        }
        if round % 2 == 0 {
            flash.pages[0][..4].copy_from_slice(&mark(Model));
        }
        assert_eq!(newest(&flash), None);
    }
}

/// Thirteen parts of 32 bytes, the longest payload.
#[test]
fn the_longest_payload_fills_all_parts_and_no_further_part_is_written() {
    let longest: Vec<u8> = (0..MOST_BYTES as u32).map(|i| (i * 7) as u8).collect();
    let (flash, stored) = store(&Flash::BLANK, &longest, Ok(()));
    assert_eq!(stored.map(|id| usize::from(id.length)), Ok(MOST_BYTES));
    assert_eq!(newest(&flash), Some(longest.clone()));

    let mut store = Store::new(flash);
    for (number, part) in (0..).zip(longest.as_chunks().0) {
        store.part(Model, number, part).unwrap();
    }
    assert_eq!(store.part(Model, MOST_PARTS, &[0; PART]), Err(Reason::PartMissing(MOST_PARTS)));
    assert_eq!(store.newest(Model).map(|(_, payload)| payload.len()), Some(MOST_BYTES), "the old one stays");
}

/// Flash that reports success and writes nothing from a number of steps on.
struct Deaf {
    flash: Flash,
    hears: usize,
}

impl Pages for Deaf {
    fn bytes(&self, page: Page) -> &[u8; PAGE] {
        self.flash.bytes(page)
    }

    fn erase(&mut self, page: Page) -> Result<(), FlashError> {
        self.hears = self.hears.saturating_sub(1);
        if self.hears > 0 { self.flash.erase(page) } else { Ok(()) }
    }

    fn program(&mut self, page: Page, at: usize, word: [u8; WORD]) -> Result<(), FlashError> {
        self.hears = self.hears.saturating_sub(1);
        if self.hears > 0 { self.flash.program(page, at, word) } else { Ok(()) }
    }
}

#[test]
fn success_is_reported_only_for_a_model_that_can_be_read_back() {
    let (old, new) = (payload(1), payload(2));
    let (flash, _) = store(&Flash::BLANK, &old, Ok(()));
    let steps = 1 + new.len().div_ceil(PART) * PART / WORD + 2;
    for hears in 0..=steps + 1 {
        let mut store = Store::new(Deaf { flash: flash.clone(), hears });
        for (number, part) in (0..).zip(new.chunks(PART)) {
            let mut bytes = [0; PART];
            bytes[..part.len()].copy_from_slice(part);
            store.part(Model, number, &bytes).unwrap();
        }
        let stored = store.end(Model, new.len() as u16, frame::checksum(&new), |_, _| Ok(()));
        let expected = if hears > steps { &new } else { &old };
        assert_eq!(stored.is_ok(), hears > steps, "deaf from step {hears} on: {stored:?}");
        assert_eq!(store.newest(Model).map(|(_, payload)| payload), Some(&expected[..]), "deaf from step {hears} on");
    }
}

/// After 2^32 - 1 stores, which no flash survives, the count could only begin again below the stored one.
#[test]
fn the_last_number_is_the_end_and_keeps_its_model() {
    let mut flash = Flash::BLANK;
    let last = payload(1);
    let id = BlockId::of(u32::MAX, &last);
    flash.pages[0][HEADER..HEADER + last.len()].copy_from_slice(&last);
    for (word, bytes) in header(Model, &id).iter().enumerate() {
        flash.pages[0][word * WORD..][..WORD].copy_from_slice(bytes);
    }
    assert_eq!(newest(&flash), Some(last.clone()));
    let (after, stored) = store(&flash, &payload(2), Ok(()));
    assert_eq!((stored, newest(&after)), (Err(Reason::NotStored), Some(last)));
}
