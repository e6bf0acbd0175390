//! A control task that hangs loses its voltage within [`LONGEST_HANG_MS`], not only when the watchdog bites.
//!
//! SysTick counts milliseconds down, above all tasks, and every tick starts the count anew. At its end the program stops:
//! voltage off by register, then last words, log, reset. Who hangs with interrupts off is left to the watchdog.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use model::supervisor::Fault;

use crate::{LONGEST_HANG_MS, stop};

/// Milliseconds left; zero while nobody ticks.
static LEFT: AtomicU32 = AtomicU32::new(0);

/// Starts the clock; `core_hz` is the processor's.
pub fn start(clock: &mut SYST, core_hz: u32) {
    clock.set_clock_source(SystClkSource::Core);
    clock.set_reload(core_hz / 1000 - 1);
    clock.clear_current();
    clock.enable_interrupt();
    clock.enable_counter();
}

/// A tick was done.
pub fn feed() {
    LEFT.store(LONGEST_HANG_MS, Ordering::Relaxed);
}

/// There will be no further tick, on purpose.
pub fn rest() {
    LEFT.store(0, Ordering::Relaxed);
}

#[cortex_m_rt::exception]
fn SysTick() {
    // Nobody interrupts this but who stops for ever.
    match LEFT.load(Ordering::Relaxed) {
        0 => {}
        1 => stop::on_fresh_stack(Fault::Watchdog),
        left => LEFT.store(left - 1, Ordering::Relaxed),
    }
}
