//! The last two pages of the chip's flash, for the store. They lie in its second bank: the program goes on in the first
//! while one of them is erased (22 ms) or written.
//!
//! A word that a power cut tore may have more wrong bits than the flash's code corrects. Reading it raises an interrupt
//! that nothing masks; what it reads then is noise, and the store's checksum says so.

#![allow(unsafe_code)]

use embassy_stm32::Peri;
use embassy_stm32::flash::{Blocking, Flash as Driver};
use embassy_stm32::pac::FLASH;
use embassy_stm32::peripherals;
use model::supervisor::Fault;

use crate::stop;
use crate::store::{PAGE, Pages, Side, WORD, Worn};

/// Where the flash begins.
const BASE: u32 = 0x0800_0000;
/// Of the first of the two pages, from there; the linker's FLASH ends here.
const OFFSET: u32 = (512 << 10) - 2 * PAGE as u32;

/// The pages.
pub struct Flash(Driver<'static, Blocking>);

impl Flash {
    /// Takes the flash.
    pub fn new(flash: Peri<'static, peripherals::FLASH>) -> Self {
        Self(Driver::new_blocking(flash))
    }
}

const fn offset(side: Side) -> u32 {
    OFFSET + side as u32 * PAGE as u32
}

impl Pages for Flash {
    fn bytes(&self, side: Side) -> &[u8; PAGE] {
        // SAFETY: flash, aligned, and written through `self` only.
        unsafe { &*((BASE + offset(side)) as *const [u8; PAGE]) }
    }

    fn erase(&mut self, side: Side) -> Result<(), Worn> {
        let from = offset(side);
        self.0.blocking_erase(from, from + PAGE as u32).map_err(|_| Worn)
    }

    fn program(&mut self, side: Side, at: usize, word: [u8; WORD]) -> Result<(), Worn> {
        self.0.blocking_write(offset(side) + at as u32, &word).map_err(|_| Worn)
    }
}

/// A torn word was read. Anything else that comes this way is unexpected.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    if FLASH.eccr().read().eccd() {
        FLASH.eccr().modify(|w| w.set_eccd(true));
    } else {
        stop::on_fresh_stack(Fault::HardFault);
    }
}
