//! Source of the last reset, from the chip's flags.

use embassy_stm32::pac::RCC;

use crate::reset_cause::Reset;

/// Reads and clears the reset flags. Call it once at boot.
pub fn reset() -> Reset {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset sets the pin's flag as well, so that flag comes last.
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
