//! Comparison of the store with the crate `sequential-storage`, which keeps key-value pairs in any number of pages, under the
//! same power cuts: both must have the old or the new payload after each cut, and the same one after each completed store.

use core::ops::Range;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use std::vec;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use random_numbers::Lcg32;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};

use super::*;

const RANGE: Range<u32> = 0..(PAGES * PAGE) as u32;

/// The simulated flash as the other crate expects it.
impl ErrorType for Flash {
    type Error = FlashError;
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let from = offset as usize;
        bytes.copy_from_slice(&self.pages.as_flattened()[from..from + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        PAGES * PAGE
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        Page::ALL[from as usize / PAGE..to as usize / PAGE].iter().try_for_each(|page| Pages::erase(self, *page))?;
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        for (at, word) in (offset as usize..).step_by(WORD).zip(bytes.as_chunks().0) {
            self.program(Page::ALL[at / PAGE], at % PAGE, *word)?;
        }
        Ok(())
    }
}

/// The result of a future that never waits.
fn now<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(result) => result,
        Poll::Pending => unreachable!("the simulated flash never waits"),
    }
}

fn other(flash: Flash) -> MapStorage<u8, Flash, impl sequential_storage::cache::CacheImpl<u8>> {
    MapStorage::new(flash, const { MapConfig::new(RANGE) }, Cache::new_uncached())
}

fn other_store(flash: &Flash, block: Block, payload: &[u8]) -> (Flash, bool) {
    let mut map = other(flash.clone());
    let stored = now(map.store_item(&mut [0; 1024], &(block as u8), &payload)).is_ok();
    (map.destroy().0, stored)
}

fn other_newest(flash: &Flash, block: Block) -> Option<Vec<u8>> {
    let mut buffer = vec![0; 1024];
    let found = now(other(flash.clone()).fetch_item::<&[u8]>(&mut buffer, &(block as u8))).expect("a readable map");
    found.map(<[u8]>::to_vec)
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn both_stores_keep_the_old_or_the_new_payload_and_agree_after_each_store() {
    const STORES: u8 = 20;
    const STEPS: usize = 80;
    let mut numbers = Lcg32::new(1);
    let (mut ours, mut theirs) = (Flash::BLANK, Flash::BLANK);
    // The last payload of each block.
    let mut last: [Option<Vec<u8>>; 2] = [None, None];
    let (mut cuts, mut kept, mut advanced) = (0, [0; 2], [0; 2]);
    for number in 1..=STORES {
        let random = numbers.draw();
        let (block, untouched) = if random >> 31 == 0 { (Model, Settings) } else { (Settings, Model) };
        let length = 1 + (random >> 8) as usize % MOST_BYTES;
        let new: Vec<u8> = (0..length).map(|i| (i as u8).wrapping_mul(number)).collect();
        for (cut, torn) in (1..STEPS).flat_map(|cut| [Torn::Nothing, Torn::All].map(|torn| (cut, torn))) {
            let until = |flash: &Flash| Flash { steps: Some(cut), torn, ..flash.clone() };
            let (our_cut, stored) = store_block(&until(&ours), block, &new, Ok(()));
            let (their_cut, their_stored) = other_store(&until(&theirs), block, &new);
            for (which, flash, complete) in [(0, our_cut, stored.is_ok()), (1, their_cut, their_stored)] {
                let flash = Flash { steps: None, ..flash };
                let read = |flash: &Flash, block| match which {
                    0 => newest_block(flash, block),
                    _ => other_newest(flash, block),
                };
                let (found, old) = (read(&flash, block), &last[block as usize]);
                let message = std::format!("store {number}, step {cut}, {torn:?}, {which}");
                assert!(found == *old || found.as_ref() == Some(&new), "{message}");
                assert!(!complete || found.as_ref() == Some(&new), "a completed store is there");
                assert_eq!(read(&flash, untouched), last[untouched as usize], "{message}: the other block");
                kept[which] += u32::from(found == *old);
                advanced[which] += u32::from(found != *old);
                // The next attempt succeeds in both.
                let again = match which {
                    0 => store_block(&flash, block, &new, Ok(())).0,
                    _ => other_store(&flash, block, &new).0,
                };
                assert_eq!(read(&again, block).as_ref(), Some(&new), "{message}");
            }
            cuts += 1;
        }
        ours = store_block(&ours, block, &new, Ok(())).0;
        theirs = other_store(&theirs, block, &new).0;
        last[block as usize] = Some(new);
        for block in [Model, Settings] {
            let stored = &last[block as usize];
            assert_eq!((&newest_block(&ours, block), &other_newest(&theirs, block)), (stored, stored));
        }
    }
    assert!(last.iter().all(Option::is_some), "both blocks were stored");
    let all = usize::from(STORES) * (STEPS - 1) * 2;
    assert!(cuts == all && kept.into_iter().chain(advanced).all(|count| count > 100), "{kept:?} {advanced:?}");
}
