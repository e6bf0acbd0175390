//! What a board must be able to do. The control task knows nothing else of it.
//!
//! A board also has a `kill()` of its own, outside of this trait because a panic has no board in its hands: zero volts and
//! amplifier off, by register, from any context, even before anything is set up.

use model::Volts;
use model::supervisor::{Drive, Monitors};

/// Where the voltage goes. A simulated plant can stand behind it as well as a converter.
pub trait Amplifier {
    /// Puts a code and the enable out. Must not wait.
    fn put(&mut self, drive: Drive);

    /// The amplifier's own view of the last tick; `None` without monitors.
    fn monitors(&mut self) -> Option<Monitors> {
        None
    }

    /// What the spring's stiffness sensor read since the last voltage went out, on the scale of volts; `None` without sensor,
    /// or without a new reading.
    fn measured(&mut self) -> Option<Volts> {
        None
    }
}

/// Everything else that the control task needs.
pub trait Board {
    /// The amplifier that this board drives.
    type Amplifier: Amplifier;

    /// The amplifier port.
    fn amplifier(&mut self) -> &mut Self::Amplifier;

    /// The safety circuit is closed. A broken wire must read as open.
    fn interlock_closed(&mut self) -> bool;

    /// Every task has checked in: the chip may live for another period of its watchdog.
    fn feed_watchdog(&mut self);

    /// A light for people: on while voltages may leave.
    fn show_armed(&mut self, _armed: bool) {}
}
