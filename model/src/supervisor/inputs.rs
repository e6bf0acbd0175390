//! Inputs of the supervisor in one tick.

use super::fault::Faults;
use super::monitors::Monitors;
use crate::units::Volts;

/// Command of a person or a host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Enables the output.
    Arm,
    /// Disables the output; in the faulted state acknowledges the fault that is shown.
    Disarm,
}

/// Everything that the supervisor decides on in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inputs {
    /// Command that came since the last tick, if any.
    pub command: Option<Command>,
    /// Desired stiffness, expressed as the equivalent static voltage.
    pub target: Volts,
    /// Ticks since the last valid frame of the host.
    pub ticks_since_host: u32,
    /// True if the safety circuit is closed.
    pub interlock_closed: bool,
    /// Ticks that were missed just before this one.
    pub missed_ticks: u32,
    /// Readings of the amplifier's monitors; `None` if it has none.
    pub monitors: Option<Monitors>,
    /// Faults that other parts of the program find in this tick, and in each tick until their causes are gone: a task
    /// that does not check in, a named cause, rejected settings, a failed test of the hardware.
    pub faults: Faults,
}

impl Default for Inputs {
    /// Returns inputs that cannot enable the output: no command, no frame of a host, interlock open.
    fn default() -> Self {
        Self {
            command: None,
            target: Volts::ZERO,
            ticks_since_host: u32::MAX,
            interlock_closed: false,
            missed_ticks: 0,
            monitors: None,
            faults: Faults::NONE,
        }
    }
}
