//! Why the chip was reset, from its own flags and from the last words.

use embassy_stm32::pac::RCC;
use model::supervisor::Fault;

use crate::cause::{Reset, cause};
use crate::last_words;

/// The cause's name, and the fault behind it. Clears the flags: once, at boot.
pub fn reset_cause() -> (&'static str, Option<Fault>) {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // A brown-out sets the pin's flag as well, and so does every other reset: the most telling one first.
    let reset = if flags.borrstf() {
        Reset::Supply
    } else if flags.iwdgrstf() {
        Reset::Watchdog
    } else if flags.sftrstf() {
        Reset::Software
    } else if flags.pinrstf() {
        Reset::Pin
    } else {
        Reset::Other
    };
    let (name, fault) = cause(reset, last_words::take());
    last_words::keep(fault);
    (name, fault)
}
