//! Time driver on the two CMSDK timers: one is the time base, the other the alarm.

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Waker;

use critical_section::{CriticalSection, Mutex};
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;

use super::interrupts::Interrupt;
use super::registers::{CLOCK_HZ, TIMER_0, TIMER_1};

/// Counts per microsecond.
const PER_US: u32 = CLOCK_HZ / 1_000_000;
/// Binary logarithm of the time base's period in us: 2^27 us = 134 s, close to the range of its 32 bits.
const WRAP_US_LOG2: u32 = 27;
const TOP: u32 = (PER_US << WRAP_US_LOG2) - 1;
const COUNT: u32 = 1;
const INTERRUPT: u32 = 1 << 3;

struct Cmsdk {
    /// Number of wrap-arounds. Not in the cell below because the log of a fault needs the time in any context.
    wraps: AtomicU32,
    queue: Mutex<RefCell<Queue>>,
}

embassy_time_driver::time_driver_impl!(static DRIVER: Cmsdk = Cmsdk {
    wraps: AtomicU32::new(0),
    queue: Mutex::new(RefCell::new(Queue::new())),
});

/// Starts the time base.
pub(super) fn init() {
    TIMER_0.reload.write(TOP);
    TIMER_0.value.write(TOP);
    TIMER_0.control.write(COUNT | INTERRUPT);
    // SAFETY: the vector table contains the handlers.
    unsafe { cortex_m::peripheral::NVIC::unmask(Interrupt::Timer0) };
    // SAFETY: as above.
    unsafe { cortex_m::peripheral::NVIC::unmask(Interrupt::Timer1) };
}

/// Handles the wrap-around of the time base.
pub(super) fn on_wrap() {
    critical_section::with(|_| {
        TIMER_0.interrupt.write(1);
        DRIVER.wraps.fetch_add(1, Ordering::Relaxed);
    });
}

/// Handles the alarm.
pub(super) fn on_alarm() {
    critical_section::with(|cs| {
        TIMER_1.interrupt.write(1);
        DRIVER.wake_and_set_alarm(cs);
    });
}

impl Cmsdk {
    fn now_in(&self, _: CriticalSection<'_>) -> u64 {
        let elapsed = || TOP - TIMER_0.value.read();
        let mut wraps = self.wraps.load(Ordering::Relaxed);
        let mut count = elapsed();
        // A wrap-around that is not yet counted; the first reading may precede it.
        if TIMER_0.interrupt.read() & 1 != 0 {
            count = elapsed();
            wraps = wraps.wrapping_add(1);
        }
        (u64::from(wraps) << WRAP_US_LOG2) + u64::from(count / PER_US)
    }

    fn wake_and_set_alarm(&self, cs: CriticalSection<'_>) {
        let now = self.now_in(cs);
        let next = self.queue.borrow_ref_mut(cs).next_expiration(now);
        TIMER_1.control.write(0);
        if next == u64::MAX {
            return;
        }
        // An alarm beyond the period expires early and is set again.
        let us = next.saturating_sub(now).clamp(1, 1 << WRAP_US_LOG2) as u32;
        TIMER_1.reload.write(0);
        TIMER_1.value.write(us * PER_US);
        TIMER_1.control.write(COUNT | INTERRUPT);
    }
}

impl Driver for Cmsdk {
    fn now(&self) -> u64 {
        critical_section::with(|cs| self.now_in(cs))
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            let sooner = self.queue.borrow_ref_mut(cs).schedule_wake(at, waker);
            if sooner {
                self.wake_and_set_alarm(cs);
            }
        });
    }
}
