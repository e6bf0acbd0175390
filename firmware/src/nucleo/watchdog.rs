//! The chip's watchdog, which runs on the low-speed clock from its start to the next reset. Its time can be changed while it runs,
//! which the driver of the chip's library does not offer.

use embassy_stm32::Peri;
use embassy_stm32::pac::IWDG;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::peripherals;

/// Longest wait for an earlier change to arrive at the low-speed clock, in reads of the register: about 1 ms. A clock that does
/// not run is found by its own test.
const MOST_READS: u32 = 20_000;

/// The watchdog that runs.
pub(super) struct Watchdog(());

impl Watchdog {
    /// Starts the watchdog: the chip is reset after `ms` without feeding, 1 to 4096.
    pub(super) fn start(_: Peri<'static, peripherals::IWDG>, ms: u32) -> Self {
        set(ms);
        IWDG.kr().write(|w| w.set_key(Key::START));
        Self(())
    }

    /// Changes the time, from the next feeding on.
    pub(super) fn set(&mut self, ms: u32) {
        let mut reads = 0;
        while IWDG.sr().read().rvu() && reads < MOST_READS {
            reads += 1;
        }
        set(ms);
    }

    /// Restarts the time.
    pub(super) fn feed(&mut self) {
        IWDG.kr().write(|w| w.set_key(Key::RESET));
    }
}

/// Sets the counter, which counts milliseconds: 32 kHz divided by 32.
fn set(ms: u32) {
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY32));
    IWDG.rlr().write(|w| w.set_rl((ms as u16).wrapping_sub(1)));
}
