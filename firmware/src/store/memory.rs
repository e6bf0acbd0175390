//! Pages in ordinary memory, for tests and simulated boards.

use super::{FlashError, PAGE, PAGES, Page, Pages, WORD};

/// Pages that never fail; erased at first.
#[derive(Clone, Debug)]
pub struct Memory([[u8; PAGE]; PAGES]);

impl Default for Memory {
    fn default() -> Self {
        Self([[0xff; PAGE]; PAGES])
    }
}

impl Pages for Memory {
    fn bytes(&self, page: Page) -> &[u8; PAGE] {
        &self.0[page.index()]
    }

    fn erase(&mut self, page: Page) -> Result<(), FlashError> {
        self.0[page.index()].fill(0xff);
        Ok(())
    }

    fn program(&mut self, page: Page, at: usize, word: [u8; WORD]) -> Result<(), FlashError> {
        let place = self.0[page.index()].get_mut(at..at + WORD).ok_or(FlashError)?;
        place.copy_from_slice(&word);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::Side;
    use link::Block;

    #[test]
    fn an_erased_page_is_all_ones_again() {
        let (mut memory, page) = (Memory::default(), Page { block: Block::Model, side: Side::A });
        memory.program(page, WORD, [0x55; WORD]).unwrap();
        assert_eq!(memory.bytes(page)[WORD], 0x55);
        memory.erase(page).unwrap();
        assert!(memory.bytes(page).iter().all(|byte| *byte == 0xff));
    }
}
