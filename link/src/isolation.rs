//! What the MCU's isolation bank says of the spring and its sensor, and the request for it.

use model::isolation::{Cause, Causes, Finding, Verdict};
use serde::{Deserialize, Serialize};

/// Request of the host about the isolation bank. The order of the variants defines their codes on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Isolation {
    /// Reads what the bank says.
    Read,
    /// Ends an alarm, then reads what the bank says: it looks for a fault anew. It acknowledges no fault.
    Acknowledge,
}

/// What the bank says after a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct IsolationReport {
    /// Number of the tick, counted from the start.
    pub tick: u64,
    /// The verdict as [`Verdict::code`]; 0x500 and the code of [`Off`] if no bank runs. Codes that this version does not know are kept.
    pub verdict: u16,
    /// Tick after which the fault has been there: that of the last restart of the sums; 0 without an alarm.
    pub since_tick: u64,
    /// Size of the cause that explains most, in the unit of [`Cause::unit`]; like the next two 0 unless one is named or two are
    /// ambiguous.
    pub size: f64,
    /// Half of the width of its 95 % interval.
    pub half_width: f64,
    /// Part of the residual's energy that it explains, 0 to 1.
    pub explained: f64,
    /// Causes that are a fault once they are named, as [`Causes::bits`].
    pub trip_on_cause: u16,
}

/// Why no isolation bank runs, or no adaptation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Off {
    /// The image is built without the bank, or without the adaptation.
    NotBuiltIn = 1,
    /// The settings have no stiffness sensor.
    NoSensor = 2,
    /// The spring's model is an extended one; only a plain spring has signatures.
    ExtendedSpring = 3,
    /// Noise, interval, range or time constant are outside of what the bank can use.
    OutOfRange = 4,
    /// The settings switch the adaptation off; the bank has no such setting.
    Settings = 5,
}

impl Off {
    /// Every reason, in the order of the codes.
    pub const ALL: [Self; 5] =
        [Self::NotBuiltIn, Self::NoSensor, Self::ExtendedSpring, Self::OutOfRange, Self::Settings];

    /// Name for tables and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotBuiltIn => "not-built-in",
            Self::NoSensor => "no-sensor",
            Self::ExtendedSpring => "extended-spring",
            Self::OutOfRange => "out-of-range",
            Self::Settings => "settings",
        }
    }
}

/// Upper byte of [`IsolationReport::verdict`] if no bank runs.
const OFF: u16 = 5 << 8;

impl IsolationReport {
    /// The report of an MCU without a running bank.
    pub fn off(why: Off, tick: u64, trip_on_cause: Causes) -> Self {
        Self { tick, verdict: OFF | why as u16, trip_on_cause: trip_on_cause.bits(), ..Self::default() }
    }

    /// The report of a bank with this verdict and `finding`.
    pub fn new(verdict: Verdict, finding: Option<Finding>, tick: u64, since_tick: u64, trip_on_cause: Causes) -> Self {
        let (size, half_width, explained) =
            finding.map_or((0.0, 0.0, 0.0), |finding| (finding.size, finding.half_width, finding.explained));
        let (verdict, trip_on_cause) = (verdict.code(), trip_on_cause.bits());
        Self { tick, verdict, since_tick, size, half_width, explained, trip_on_cause }
    }

    /// The verdict; `None` if no bank runs, and for a code that this version does not know.
    pub fn verdict(&self) -> Option<Verdict> {
        Verdict::from_code(self.verdict)
    }

    /// Why no bank runs; `None` if one does, and for a code that this version does not know.
    pub fn why_off(&self) -> Option<Off> {
        Off::ALL.into_iter().find(|why| self.verdict == OFF | *why as u16)
    }

    /// Word for tables and JSON: that of the verdict, `off`, or `unknown-code` for a code that this version does not know.
    pub fn word(&self) -> &'static str {
        match self.verdict() {
            Some(verdict) => verdict.name(),
            None if self.verdict & 0xff00 == OFF => "off",
            None => "unknown-code",
        }
    }

    /// The causes that are a fault once they are named.
    pub fn trips(&self) -> impl Iterator<Item = Cause> {
        Causes::from_bits(self.trip_on_cause).iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_stable_and_have_words() {
        let word = |verdict| IsolationReport { verdict, ..IsolationReport::default() }.word();
        let words = [0, 0x100, 0x200, 0x300, 0x4a0, 0x501, 0x5ff, 0x600].map(word).join(" ");
        assert_eq!(words, "quiet alarm unknown named ambiguous off off unknown-code");
        let why = |code| IsolationReport { verdict: OFF | code, ..IsolationReport::default() }.why_off().map(Off::name);
        let names = ["not-built-in", "no-sensor", "extended-spring", "out-of-range", "settings"];
        assert_eq!([1, 2, 3, 4, 5].map(why), names.map(Some));
        assert_eq!(why(6), None);
        let trips = Causes::NONE.with(Cause::GainError).with(Cause::StuckSensor);
        let off = IsolationReport::off(Off::NoSensor, 7, trips);
        assert_eq!((off.tick, off.verdict(), off.why_off()), (7, None, Some(Off::NoSensor)));
        assert!(off.trips().eq([Cause::GainError, Cause::StuckSensor]));
        let report = IsolationReport::new(Verdict::Named(Cause::Delay), None, 7, 5, trips);
        assert_eq!((report.verdict(), report.why_off()), (Some(Verdict::Named(Cause::Delay)), None));
        assert!(report.trips().eq([Cause::GainError, Cause::StuckSensor]));
    }
}
