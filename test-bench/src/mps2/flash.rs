//! Four pages for the store. The board has no flash: the pages are in its PSRAM, which keeps its content during a reset
//! until the emulator ends, and in the file `model.flash` of the emulator's folder if it exists, which keeps it beyond that.

use firmware::store::{FlashError, PAGE, PAGES, Page, Pages, WORD};

use super::semihosting::{File, Mode};

/// Address of the PSRAM; nothing else uses it.
const ADDRESS: u32 = 0x2100_0000;

/// Address of the word that says that the pages have been erased since the emulator's start; behind the pages.
const USED: *mut u32 = (ADDRESS + (PAGES * PAGE) as u32) as *mut u32;
/// "vsjf", the value of that word.
const MARK: u32 = 0x7673_6a66;

/// The pages.
#[derive(Debug)]
pub struct Flash {
    file: Option<File>,
}

impl Flash {
    /// Reads the pages from the file; without one, erases them at the first boot and keeps them at every other. Call it once
    /// at boot.
    pub fn init() -> Self {
        let mut flash = Self { file: File::open(c"model.flash", Mode::Update) };
        // SAFETY: nothing else refers to this word of the PSRAM.
        let used = unsafe { USED.read_volatile() == MARK };
        if flash.file.is_none() && used {
            return flash;
        }
        for page in Page::ALL {
            let bytes = flash.page(page);
            let read = flash.file.as_mut().is_some_and(|file| file.seek(page.index() * PAGE) && file.read(bytes));
            if !read {
                bytes.fill(0xff);
            }
        }
        // SAFETY: as above.
        unsafe { USED.write_volatile(MARK) };
        flash
    }

    fn page(&mut self, page: Page) -> &'static mut [u8; PAGE] {
        // SAFETY: nothing else refers to this memory; `bytes` borrows from `self`, and so do the functions that change it.
        unsafe { &mut *((ADDRESS + (page.index() * PAGE) as u32) as *mut [u8; PAGE]) }
    }

    fn save(&mut self, page: Page, at: usize, bytes: &[u8]) -> Result<(), FlashError> {
        let saved = self.file.as_mut().is_none_or(|file| file.seek(page.index() * PAGE + at) && file.write(bytes));
        if saved { Ok(()) } else { Err(FlashError) }
    }
}

impl Pages for Flash {
    fn bytes(&self, page: Page) -> &[u8; PAGE] {
        // SAFETY: as above.
        unsafe { &*((ADDRESS + (page.index() * PAGE) as u32) as *const [u8; PAGE]) }
    }

    fn erase(&mut self, page: Page) -> Result<(), FlashError> {
        let bytes = self.page(page);
        bytes.fill(0xff);
        self.save(page, 0, bytes)
    }

    fn program(&mut self, page: Page, at: usize, word: [u8; WORD]) -> Result<(), FlashError> {
        let place = self.page(page).get_mut(at..at + WORD).ok_or(FlashError)?;
        // Only an erased word can be written, as in flash.
        if place != [0xff; WORD] {
            return Err(FlashError);
        }
        place.copy_from_slice(&word);
        self.save(page, at, &word)
    }
}
