//! What the supervisor is told in a tick.

use super::{Fault, Monitors};
use crate::units::Volts;

/// What a person or a host orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Let voltages out.
    Arm,
    /// Take the voltage away; acknowledges a fault.
    Disarm,
}

/// What a tick knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inputs {
    /// Given since the last tick.
    pub command: Option<Command>,
    /// Static voltage of the desired stiffness.
    pub target: Volts,
    /// Ticks since the last valid frame of the host.
    pub ticks_since_host: u32,
    /// The safety circuit is closed.
    pub interlock_closed: bool,
    /// Ticks that were left out just before this one.
    pub missed_ticks: u32,
    /// Readings of the amplifier, where it has monitors.
    pub monitors: Option<Monitors>,
    /// What somebody else found: a task that does not check in, refused settings.
    pub fault: Option<Fault>,
}

impl Default for Inputs {
    /// Nothing ordered, nobody heard, interlock open: nothing that could let a voltage out.
    fn default() -> Self {
        Self {
            command: None,
            target: Volts::ZERO,
            ticks_since_host: u32::MAX,
            interlock_closed: false,
            missed_ticks: 0,
            monitors: None,
            fault: None,
        }
    }
}
