//! Why the chip was reset, by its own flags.

use embassy_stm32::pac::RCC;

use crate::cause::Reset;

/// What the flags say. Clears them: once, at boot.
pub fn reset() -> Reset {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // A brown-out sets the pin's flag as well, and so does every other reset: the most telling one first.
    if flags.borrstf() {
        Reset::Supply
    } else if flags.iwdgrstf() {
        Reset::Watchdog
    } else if flags.sftrstf() {
        Reset::Software
    } else if flags.pinrstf() {
        Reset::Pin
    } else {
        Reset::Other
    }
}
