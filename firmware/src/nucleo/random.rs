//! The chip's random number generator.

use embassy_stm32::pac::{RCC, RNG};

/// Reads of the status after which the generator counts as broken: a number takes about 3 us.
const MOST_READS: u32 = 10_000;

/// A random number, for the nonces of the link's sessions. `None` if the generator does not deliver one.
pub fn seed() -> Option<u32> {
    // Its clock of 48 MHz runs since `embassy_stm32::init`.
    RCC.ahb2enr().modify(|w| w.set_rngen(true));
    RNG.cr().modify(|w| w.set_rngen(true));
    let ready = (0..MOST_READS).any(|_| RNG.sr().read().drdy());
    // A generator that has failed delivers zero.
    ready.then(|| RNG.dr().read()).filter(|number| *number != 0)
}
