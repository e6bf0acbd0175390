//! The CMSDK watchdog: an interrupt that nothing can mask after 100 ms without food, a reset after 200 ms.

use super::registers::{CLOCK_HZ, WATCHDOG_CONTROL, WATCHDOG_FEED, WATCHDOG_LOAD};

/// Starts it; it cannot be forgotten from here on.
pub(super) fn init() {
    WATCHDOG_LOAD.write(CLOCK_HZ / 10);
    WATCHDOG_CONTROL.write(0b11);
}

/// Another 100 ms.
pub(super) fn feed() {
    WATCHDOG_FEED.write(1);
}
