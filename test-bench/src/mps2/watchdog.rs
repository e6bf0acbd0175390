//! The CMSDK watchdog: a non-maskable interrupt 100 ms after the last feeding, a reset after 200 ms.

use super::registers::{CLOCK_HZ, WATCHDOG_CONTROL, WATCHDOG_FEED, WATCHDOG_LOAD};

/// Starts the watchdog; it must be fed from here on.
pub(super) fn init() {
    WATCHDOG_LOAD.write(CLOCK_HZ / 10);
    WATCHDOG_CONTROL.write(0b11);
}

/// Restarts the period of 100 ms.
pub(super) fn feed() {
    WATCHDOG_FEED.write(1);
}
