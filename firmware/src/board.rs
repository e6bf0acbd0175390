//! Traits that a board implements. The control task and the host's task access the hardware only through them.
//!
//! A board also defines the function `switch_amplifier_off`, see the module `stop`.

use core::future::Future;

use model::Volts;
use model::supervisor::{Drive, Fault, Monitors};

/// Output to the amplifier, and the sensors at it. A simulated plant can implement it as well as a converter.
pub trait Amplifier {
    /// Writes the DAC code and the enable output. Must not block.
    fn put(&mut self, drive: Drive);

    /// Readings of the amplifier's voltage and current monitors for the last tick; `None` without monitors.
    fn monitors(&mut self) -> Option<Monitors> {
        None
    }

    /// Reading of the stiffness sensor since the last output, as equivalent static voltage; `None` without a sensor or without a
    /// new reading.
    fn measured(&mut self) -> Option<Volts> {
        None
    }
}

/// Hardware of the control task.
pub trait Board {
    /// Type of the amplifier port.
    type Amplifier: Amplifier;

    /// The amplifier port.
    fn amplifier(&mut self) -> &mut Self::Amplifier;

    /// True if the safety circuit is closed. A broken wire must read as open.
    fn interlock_closed(&mut self) -> bool;

    /// Restarts the period of the hardware watchdog.
    fn feed_watchdog(&mut self);

    /// Fault that a test of the hardware has found at the start; it stands until the chip is restarted.
    fn fault(&self) -> Option<Fault> {
        None
    }

    /// Switches the indicator that the output is enabled.
    fn show_armed(&mut self, _armed: bool) {}
}

/// Serial line to the host.
pub trait Line {
    /// Waits for bytes and returns their number. May be cancelled without losing bytes.
    fn read(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize>;

    /// Sends all of `bytes`.
    fn write(&mut self, bytes: &[u8]) -> impl Future<Output = ()>;
}
