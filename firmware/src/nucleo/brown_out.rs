//! The level of the supply below which the chip holds itself in reset: an option of the chip, which the firmware reads and
//! does not program.

use embassy_stm32::pac::FLASH;
use link::BrownOut;

/// Expected level: 4, the highest, 2.8 V. As delivered it is 0, 1.7 V.
const EXPECTED: u8 = 4;

/// The level that is set, and the expected one.
pub fn read() -> BrownOut {
    BrownOut { level: FLASH.optr().read().bor_lev(), expected: EXPECTED }
}
