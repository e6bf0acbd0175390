//! Comparison of the amplifier's monitors with the output.
//!
//! Important terms:
//!
//! - *monitor*: an analog output of the amplifier that reads its own voltage or current.
//! - *expected voltage*: what was put out; 0 V while the output is disabled.
//! - *disagreement*: the voltage differs from the expected one by more than the tolerance, or the current is too large.
//!
//! While the output is enabled a disagreement may last as long as the amplifier takes to settle; while it is disabled,
//! as long as the spring takes to discharge.

use super::settings::Config;
use crate::units::Volts;

/// Readings of the amplifier's monitors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Monitors {
    /// Voltage at the amplifier's output, in V.
    pub voltage: Volts,
    /// Current into the spring, in uA; negative while it discharges.
    pub current_ua: i32,
}

/// Counter of the ticks for which the monitors have disagreed with the output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct MonitorCheck {
    /// The voltage that was put out; `None` while the output is disabled.
    driven: Option<Volts>,
    ticks: u32,
}

impl MonitorCheck {
    /// The output is disabled, and no disagreement was seen.
    pub(super) const NEW: Self = Self { driven: None, ticks: 0 };

    /// Sets the voltage with which the next readings are compared; `None` if the output is disabled. The counter
    /// restarts when the output is enabled or disabled.
    pub(super) fn expect(&mut self, driven: Option<Volts>) {
        if driven.is_some() != self.driven.is_some() {
            self.ticks = 0;
        }
        self.driven = driven;
    }

    /// Compares the readings of one tick; returns true if they have disagreed for too long.
    pub(super) fn update(&mut self, config: &Config, monitors: Option<Monitors>) -> bool {
        let disagree = monitors.is_some_and(|monitors| {
            let expected = self.driven.unwrap_or(Volts::ZERO);
            let difference = monitors.voltage.0.saturating_sub(expected.0).saturating_abs();
            difference > config.tolerance || monitors.current_ua.saturating_abs() > config.max_current_ua
        });
        self.ticks = if disagree { self.ticks.saturating_add(1) } else { 0 };
        self.ticks > if self.driven.is_some() { config.monitor_ticks } else { config.discharge_ticks }
    }

    /// Returns true if the last readings disagreed.
    pub(super) fn disagree(&self) -> bool {
        self.ticks > 0
    }
}
