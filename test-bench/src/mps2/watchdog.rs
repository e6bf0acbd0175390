//! The CMSDK watchdog: a non-maskable interrupt when it was not fed in time, a reset after twice that time.

use super::registers::{CLOCK_HZ, WATCHDOG_CONTROL, WATCHDOG_FEED, WATCHDOG_LOAD};

/// Starts the watchdog; it must be fed within `ms` from here on.
pub(super) fn start(ms: u32) {
    WATCHDOG_LOAD.write(CLOCK_HZ / 1000 * ms);
    WATCHDOG_CONTROL.write(0b11);
}

/// Restarts the period.
pub(super) fn feed() {
    WATCHDOG_FEED.write(1);
}
