//! The last four pages of the chip's flash, for the store. They are in its second bank: the program, which the linker
//! places in the first bank only, continues while a page is erased (22 ms) or written.
//!
//! A word whose writing was interrupted by a power cut can have more wrong bits than the flash's error correction (ECC) can
//! correct. Reading it raises a non-maskable interrupt and returns undefined data, which the store's checksum detects. Any
//! other such word is code or a constant, and causes an emergency stop.

#![allow(unsafe_code)]

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::flash::{Blocking, Flash as Driver};
use embassy_stm32::pac::FLASH;
use embassy_stm32::peripherals;
use model::supervisor::Fault;

use crate::stop;
use crate::store::{FlashError, PAGE, PAGES, Page, Pages, WORD};
use link::Block;

/// Address of the flash.
const BASE: u32 = 0x0800_0000;
/// Offset of the first of the pages, in bytes.
const OFFSET: u32 = (512 << 10) - (PAGES * PAGE) as u32;

/// True while the pages are read. The output is disabled during that time, before the first tick or while a block is stored,
/// and the thread does nothing else.
static READING: AtomicBool = AtomicBool::new(false);

/// The pages.
pub struct Flash(Driver<'static, Blocking>);

impl Flash {
    /// Initialises the access to the flash.
    pub fn new(flash: Peri<'static, peripherals::FLASH>) -> Self {
        Self(Driver::new_blocking(flash))
    }
}

/// Offset of a page: the settings come first, so that the model stays in the last two pages.
const fn offset(page: Page) -> u32 {
    let first = match page.block {
        Block::Settings => 0,
        Block::Model => 2,
    };
    OFFSET + (first + page.side as u32) * PAGE as u32
}

impl Pages for Flash {
    fn bytes(&self, page: Page) -> &[u8; PAGE] {
        // SAFETY: an aligned page of the flash, which is written through `self` only.
        unsafe { &*((BASE + offset(page)) as *const [u8; PAGE]) }
    }

    fn tolerate_bit_errors<T>(&self, read: impl FnOnce() -> T) -> T {
        READING.store(true, Ordering::Relaxed);
        // The barriers keep all accesses of `read` within the marked period.
        cortex_m::asm::dsb();
        let result = read();
        cortex_m::asm::dsb();
        READING.store(false, Ordering::Relaxed);
        result
    }

    fn erase(&mut self, page: Page) -> Result<(), FlashError> {
        let from = offset(page);
        self.0.blocking_erase(from, from + PAGE as u32).map_err(|_| FlashError)
    }

    fn program(&mut self, page: Page, at: usize, word: [u8; WORD]) -> Result<(), FlashError> {
        self.0.blocking_write(offset(page) + at as u32, &word).map_err(|_| FlashError)
    }
}

/// Handles a word with an uncorrectable error, which is tolerated in the store only. The flag decides, not the address
/// and bank in the register: ST's EEPROM emulation for this chip does not rely on those either.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    if FLASH.eccr().read().eccd() && READING.load(Ordering::Relaxed) {
        FLASH.eccr().modify(|w| w.set_eccd(true));
    } else {
        stop::on_fresh_stack(Fault::HardFault);
    }
}
