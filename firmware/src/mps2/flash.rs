//! Two pages of flash for the store. The board has none: they lie in its PSRAM, which outlives a reset, and in the file
//! `model.flash` of the emulator's folder, if there is one, which outlives the emulator.

use super::semihosting::{File, Mode};
use crate::store::{PAGE, Pages, Side, WORD, Worn};

/// The PSRAM; nothing else uses it.
const ADDRESS: u32 = 0x2100_0000;

/// The pages.
#[derive(Debug)]
pub struct Flash {
    file: Option<File>,
}

impl Flash {
    /// As the file has them, or erased. Once, at boot.
    pub fn init() -> Self {
        let mut flash = Self { file: File::open(c"model.flash", Mode::Update) };
        for side in [Side::A, Side::B] {
            let page = flash.page(side);
            let read = flash.file.as_mut().is_some_and(|file| file.seek(side as usize * PAGE) && file.read(page));
            if !read {
                page.fill(0xff);
            }
        }
        flash
    }

    fn page(&mut self, side: Side) -> &'static mut [u8; PAGE] {
        // SAFETY: memory that nobody else refers to; `bytes` borrows from `self`, and so do who changes it.
        unsafe { &mut *((ADDRESS + side as u32 * PAGE as u32) as *mut [u8; PAGE]) }
    }

    fn keep(&mut self, side: Side, at: usize, bytes: &[u8]) -> Result<(), Worn> {
        let kept = self.file.as_mut().is_none_or(|file| file.seek(side as usize * PAGE + at) && file.write(bytes));
        if kept { Ok(()) } else { Err(Worn) }
    }
}

impl Pages for Flash {
    fn bytes(&self, side: Side) -> &[u8; PAGE] {
        // SAFETY: as above.
        unsafe { &*((ADDRESS + side as u32 * PAGE as u32) as *const [u8; PAGE]) }
    }

    fn erase(&mut self, side: Side) -> Result<(), Worn> {
        let page = self.page(side);
        page.fill(0xff);
        self.keep(side, 0, page)
    }

    fn program(&mut self, side: Side, at: usize, word: [u8; WORD]) -> Result<(), Worn> {
        let place = self.page(side).get_mut(at..at + WORD).ok_or(Worn)?;
        // As in flash: only an erased word takes another one.
        if place != [0xff; WORD] {
            return Err(Worn);
        }
        place.copy_from_slice(&word);
        self.keep(side, at, &word)
    }
}
