//! Whether the amplifier does what it is told.
//!
//! Its monitors are held against what was put out: while nothing may leave, against nothing. A disagreement may last as long
//! as the amplifier takes to settle while it is driven, and else as long as a voltage that was taken away takes to go.

use super::Config;
use crate::units::Volts;

/// What the amplifier says about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Monitors {
    /// Voltage at its output, in V.
    pub voltage: Volts,
    /// Current into the spring, in uA.
    pub current_ua: i32,
}

/// Counts the ticks of a disagreement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Watch {
    driven: Option<Volts>,
    ticks: u32,
}

impl Watch {
    /// Nothing was put out, nothing seen.
    pub(super) const NEW: Self = Self { driven: None, ticks: 0 };

    /// What the next look is held against: the voltage that is put out now, if any may leave. The time that a
    /// disagreement may last begins anew where that changes.
    pub(super) fn expect(&mut self, driven: Option<Volts>) {
        if driven.is_some() != self.driven.is_some() {
            self.ticks = 0;
        }
        self.driven = driven;
    }

    /// Looks at a tick's readings; true if they have disagreed for too long.
    pub(super) fn look(&mut self, config: &Config, monitors: Option<Monitors>) -> bool {
        let far = monitors.is_some_and(|monitors| {
            let off = monitors.voltage.0.saturating_sub(self.driven.unwrap_or(Volts::ZERO).0).saturating_abs();
            off > config.tolerance || monitors.current_ua.saturating_abs() > config.max_current_ua
        });
        self.ticks = if far { self.ticks.saturating_add(1) } else { 0 };
        self.ticks > if self.driven.is_some() { config.monitor_ticks } else { config.discharge_ticks }
    }

    /// Whether the last look's readings disagreed.
    pub(super) fn disagrees(&self) -> bool {
        self.ticks > 0
    }
}
