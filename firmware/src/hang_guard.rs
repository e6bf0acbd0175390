//! Stop of a control task that hangs, within [`LONGEST_HANG_MS`](crate::LONGEST_HANG_MS) instead of the watchdog's 100 ms, or
//! within what the stored settings say.
//!
//! The SysTick interrupt has a higher priority than all tasks. It counts milliseconds down and every tick restarts the count;
//! at zero it performs the emergency stop. A task that hangs with interrupts off is left to the watchdog.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use model::supervisor::Fault;

use crate::stop;

/// Remaining milliseconds, or 0 while the guard is inactive.
static LEFT: AtomicU32 = AtomicU32::new(0);

/// Starts SysTick with a period of 1 ms; `core_hz` is the processor's clock, in Hz. The guard is inactive until [`feed`].
pub fn start(clock: &mut SYST, core_hz: u32) {
    clock.set_clock_source(SystClkSource::Core);
    clock.set_reload(core_hz / 1000 - 1);
    clock.clear_current();
    clock.enable_interrupt();
    clock.enable_counter();
}

/// Restarts the count after a tick: the next one has to end within `ms`.
pub fn feed(ms: u32) {
    LEFT.store(ms, Ordering::Relaxed);
}

/// Deactivates the guard after the last tick of a run.
pub fn rest() {
    LEFT.store(0, Ordering::Relaxed);
}

#[cortex_m_rt::exception]
fn SysTick() {
    // Only the emergency stop can interrupt this.
    match LEFT.load(Ordering::Relaxed) {
        0 => {}
        1 => stop::on_fresh_stack(Fault::Watchdog),
        left => LEFT.store(left - 1, Ordering::Relaxed),
    }
}
