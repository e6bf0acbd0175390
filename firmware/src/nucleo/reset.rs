//! Why the chip was reset, from its own flags and from the last words.

use embassy_stm32::pac::RCC;
use model::supervisor::Fault;

use crate::last_words::{self, Legacy};

/// The cause's name, and the fault behind it. Clears the flags: once, at boot.
pub fn reset_cause() -> (&'static str, Option<Fault>) {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    let fault = match last_words::take() {
        Legacy::Stopped(fault, _) => Some(fault),
        Legacy::None | Legacy::Silent | Legacy::Told => None,
    };
    // A brown-out sets the pin's flag as well, and so does every other reset: the most telling one first.
    if flags.borrstf() {
        ("power-on", None)
    } else if flags.iwdgrstf() {
        ("watchdog", Some(fault.unwrap_or(Fault::Watchdog)))
    } else if flags.sftrstf() {
        ("software", fault)
    } else if flags.pinrstf() {
        ("pin", None)
    } else {
        ("other", fault)
    }
}
