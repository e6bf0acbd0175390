//! The level of the supply below which the chip holds itself in reset: an option of the chip, which the firmware reads and
//! does not program.

use embassy_stm32::pac::FLASH;

/// Expected level: 4, the highest, 2.8 V. As delivered it is 0, 1.7 V.
pub const EXPECTED: u8 = 4;

/// The level if it is not the expected one.
pub fn unexpected() -> Option<u8> {
    let level = FLASH.optr().read().bor_lev();
    (level != EXPECTED).then_some(level)
}
