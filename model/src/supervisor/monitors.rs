//! Comparison of the amplifier's monitors with the output.
//!
//! Important terms:
//!
//! - *monitor*: an analog output of the amplifier that reads its own voltage or current.
//! - *expected voltage*: what was put out; 0 V while the output is disabled.
//! - *disagreement*: the voltage differs from the expected one by more than the tolerance, the current is too large, or the
//!   supply of the converters is out of its range ([`Mismatch`]).
//! - *supply of the converters*: the voltage to which DAC and ADC both refer. If it is wrong, the output is wrong and the
//!   monitors agree with it: only a reference of its own shows it.
//!
//! While the output is enabled a disagreement may last as long as the amplifier takes to settle; while it is disabled,
//! as long as the spring takes to discharge. A tick that agrees takes off one that disagreed, so that a noisy monitor is
//! a fault as well: if a fraction `p > 1/2` of its readings disagrees, within `1 / (2 p - 1)` of these times on average.
//!
//! An amplifier that is too slow is distinguished from one that is at a limit, or has another scale, by the second half of that time: its
//! voltage still approaches the expected one. An approach of less than twice what the expected voltage itself moves does not count, since
//! an amplifier with another scale follows it as well.
//!
//! Not detectable: a monitor that disagrees in less than half of the ticks, which an amplifier that settles after each
//! change does too; a reading that is late by less than the amplifier may take to settle; a load that is disconnected,
//! because the current of a change has passed between two readings.

use super::settings::Config;
use crate::units::{Signal, Volts};

/// Smallest approach to the expected voltage by which a slow amplifier is recognised, as a binary fraction of the tolerance: 1/16.
const APPROACH_BITS: u32 = 4;

/// Readings of the amplifier's monitors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Monitors {
    /// Voltage at the amplifier's output, in V.
    pub voltage: Volts,
    /// Current into the spring, in uA; negative while it discharges.
    pub current_ua: i32,
    /// Supply of the converters, in mV, measured against a reference of its own; `None` without one.
    pub supply_mv: Option<u16>,
}

/// What disagrees with the output. The numbers are used in frames and never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Mismatch {
    /// The voltage is below the expected one, and the current is not too large: the amplifier is at a limit of its own.
    Limit = 1,
    /// There is neither a voltage nor a current: the amplifier, its monitor or the wire between is open or off.
    Open = 2,
    /// The voltage is below the expected one, and the current is too large.
    Short = 3,
    /// The voltage is the expected one, and the current is too large.
    Leakage = 4,
    /// The supply of the converters is out of its range, or the voltage is above the expected one: another scale.
    Reference = 5,
    /// The output is disabled, and there is a voltage or a current.
    Held = 6,
    /// The voltage approaches the expected one, but too slowly, and the current is not too large.
    Slew = 7,
}

impl Mismatch {
    /// Every kind, in the order of the numbers.
    pub const ALL: [Self; 7] =
        [Self::Limit, Self::Open, Self::Short, Self::Leakage, Self::Reference, Self::Held, Self::Slew];

    /// Returns the stable number, 1 to 255; zero stands for no disagreement.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// Returns the stable lower-case name for logs and tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Limit => "limit",
            Self::Open => "open",
            Self::Short => "short",
            Self::Leakage => "leakage",
            Self::Reference => "reference",
            Self::Held => "held",
            Self::Slew => "slew",
        }
    }
}

/// Counter of the ticks in which the monitors have disagreed with the output, less those in which they have agreed since.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct MonitorCheck {
    /// The voltage that was put out; `None` while the output is disabled.
    driven: Option<Volts>,
    ticks: u32,
    /// What disagreed in the last tick.
    mismatch: Option<Mismatch>,
    /// The expected voltage and its reading in the last tick of the first half of the time that a disagreement may last.
    halfway: (Volts, Volts),
}

impl MonitorCheck {
    /// The output is disabled, and no disagreement was seen.
    pub(super) const NEW: Self = Self { driven: None, ticks: 0, mismatch: None, halfway: (Volts::ZERO, Volts::ZERO) };

    /// Sets the voltage with which the next readings are compared; `None` if the output is disabled. The counter
    /// restarts when the output is enabled or disabled.
    pub(super) fn expect(&mut self, driven: Option<Volts>) {
        if driven.is_some() != self.driven.is_some() {
            self.ticks = 0;
        }
        self.driven = driven;
    }

    /// Compares the readings of one tick; returns true if they have disagreed in too many.
    pub(super) fn update(&mut self, config: &Config, monitors: Option<Monitors>) -> bool {
        self.mismatch = monitors.and_then(|monitors| self.compare(config, &monitors));
        let allowed = if self.driven.is_some() { config.monitor_ticks } else { config.discharge_ticks };
        if let (Some(driven), Some(monitors)) = (self.driven, monitors)
            && self.ticks <= allowed / 2
        {
            self.halfway = (driven, monitors.voltage);
        }
        // Counted no further than to the fault, so that it is forgotten within the same time.
        self.ticks = match self.mismatch {
            Some(_) => self.ticks.min(allowed).saturating_add(1),
            None => self.ticks.saturating_sub(1),
        };
        self.ticks > allowed
    }

    /// Returns what disagreed in the last tick.
    pub(super) fn mismatch(&self) -> Option<Mismatch> {
        self.mismatch
    }

    fn compare(&self, config: &Config, monitors: &Monitors) -> Option<Mismatch> {
        let (lowest, highest) = config.supply_mv;
        if monitors.supply_mv.is_some_and(|supply| supply < lowest || supply > highest) {
            return Some(Mismatch::Reference);
        }
        let excess = |expected: Volts| monitors.voltage.0.saturating_sub(expected.0);
        let far = |expected| excess(expected).saturating_abs() > config.tolerance;
        let current = monitors.current_ua.saturating_abs() > config.max_current_ua;
        let Some(driven) = self.driven else {
            return (far(Volts::ZERO) || current).then_some(Mismatch::Held);
        };
        match (far(driven), current) {
            (false, false) => None,
            (false, true) => Some(Mismatch::Leakage),
            (true, true) => Some(Mismatch::Short),
            (true, false) if self.approaches(driven, monitors.voltage, config.tolerance) => Some(Mismatch::Slew),
            (true, false) if excess(driven).is_positive() => Some(Mismatch::Reference),
            (true, false) if far(Volts::ZERO) => Some(Mismatch::Limit),
            (true, false) => Some(Mismatch::Open),
        }
    }

    /// Returns true if the voltage has come closer to the expected one since half of the allowed time, and not because that has moved.
    fn approaches(&self, driven: Volts, voltage: Volts, tolerance: Signal) -> bool {
        let (driven_before, voltage_before) = self.halfway;
        let distance = |from: Volts| driven.0.saturating_sub(from.0).saturating_abs();
        let approach = distance(voltage_before).saturating_sub(distance(voltage));
        let expected = distance(driven_before);
        approach > expected.saturating_add(expected).saturating_add(tolerance >> APPROACH_BITS)
    }
}
