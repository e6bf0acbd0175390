//! The last two pages of the chip's flash, for the store. They lie in its second bank: the program goes on in the first,
//! which is all that the linker gives it, while one of them is erased (22 ms) or written.
//!
//! A word that a power cut tore may have more wrong bits than the flash's code corrects. Reading it raises an interrupt
//! that nothing masks; what it reads then is noise, and the store's checksum says so. Anywhere else such a word is code or
//! a constant, and the program stops.

#![allow(unsafe_code)]

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::flash::{Blocking, Flash as Driver};
use embassy_stm32::pac::FLASH;
use embassy_stm32::peripherals;
use model::supervisor::Fault;

use crate::stop;
use crate::store::{PAGE, Pages, Side, WORD, Worn};

/// Where the flash begins.
const BASE: u32 = 0x0800_0000;
/// Of the first of the two pages, from there.
const OFFSET: u32 = (512 << 10) - 2 * PAGE as u32;

/// The pages are being looked through. Nothing else goes on below the tasks meanwhile, and no voltage may leave: before the
/// first tick, or while a model is taken.
static READING: AtomicBool = AtomicBool::new(false);

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

    fn forgiving<T>(&self, read: impl FnOnce() -> T) -> T {
        READING.store(true, Ordering::Relaxed);
        // Nothing is read before that, and all of it before the next.
        cortex_m::asm::dsb();
        let result = read();
        cortex_m::asm::dsb();
        READING.store(false, Ordering::Relaxed);
        result
    }

    fn erase(&mut self, side: Side) -> Result<(), Worn> {
        let from = offset(side);
        self.0.blocking_erase(from, from + PAGE as u32).map_err(|_| Worn)
    }

    fn program(&mut self, side: Side, at: usize, word: [u8; WORD]) -> Result<(), Worn> {
        self.0.blocking_write(offset(side) + at as u32, &word).map_err(|_| Worn)
    }
}

/// A word with two wrong bits was read: forgiven in the store only. What is being read says where, not the register's
/// address and bank: ST's own EEPROM emulation for this chip does not go by them either.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    if FLASH.eccr().read().eccd() && READING.load(Ordering::Relaxed) {
        FLASH.eccr().modify(|w| w.set_eccd(true));
    } else {
        stop::on_fresh_stack(Fault::HardFault);
    }
}
