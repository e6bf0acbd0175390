//! What the MCU's adaptation does, and the request for it.

use model::Plant;
use model::adaptation::{Parameters, Phase, Settings};
use serde::{Deserialize, Serialize};

use crate::isolation::Off;

/// Request of the host about the adaptation. The order of the variants defines their codes on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Adaptation {
    /// Reads what it does.
    Read,
    /// Switches it off until it is switched on or the MCU restarts, then reads what it does: the model goes back to the stored one.
    Off,
    /// Switches it on, also after it has stopped by itself, then reads what it does.
    On,
}

impl Adaptation {
    /// What is to be switched; `None` if nothing is.
    pub const fn switch(self) -> Option<bool> {
        match self {
            Self::Read => None,
            Self::Off => Some(false),
            Self::On => Some(true),
        }
    }
}

/// What the adaptation does after a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AdaptationReport {
    /// Number of the tick, counted from the start.
    pub tick: u64,
    /// Place of the phase in [`Phase::ALL`]; 0x80 and the code of [`Off`] if nothing can adapt. Codes that this version does not know
    /// are kept.
    pub phase: u8,
    /// Time constant, share and gain of the running model, as ratios to the stored one.
    pub ratios: [f64; 3],
    /// Largest relative deviation of each from the stored one, both ways.
    pub bounds: [f64; 3],
    /// Time constant, in s, and share of the stored model; like the ratios and the bounds 0 if nothing can adapt.
    pub stored: [f64; 2],
    /// Number of exchanges of the configuration since the start.
    pub exchanges: u32,
    /// Tick of the last exchange; 0 without one.
    pub exchange_tick: u64,
}

/// Bit of [`AdaptationReport::phase`] if nothing can adapt.
const OFF: u8 = 0x80;

impl AdaptationReport {
    /// The report of an MCU on which nothing can adapt.
    pub fn off(why: Off, tick: u64) -> Self {
        Self { tick, phase: OFF | why as u8, ..Self::default() }
    }

    /// The report of an adaptation of the model `stored` that has not exchanged anything yet.
    pub fn new(phase: Phase, parameters: &Parameters, settings: &Settings, stored: Plant) -> Self {
        let Parameters { time_constant, share, gain } = *parameters;
        let bounds = [settings.time_constant, settings.share, settings.gain];
        let stored = [stored.time_constant_s, stored.share];
        Self { phase: phase as u8, ratios: [time_constant, share, gain], bounds, stored, ..Self::default() }
    }

    /// The phase; `None` if nothing can adapt, and for a code that this version does not know.
    pub fn phase(&self) -> Option<Phase> {
        Phase::ALL.get(usize::from(self.phase)).copied()
    }

    /// Why nothing can adapt; `None` if something can, and for a code that this version does not know.
    pub fn why_off(&self) -> Option<Off> {
        Off::ALL.into_iter().find(|why| self.phase == OFF | *why as u8)
    }

    /// Word for tables and JSON: that of the phase, `off`, or `unknown-code` for a code that this version does not know.
    pub fn word(&self) -> &'static str {
        match self.phase() {
            Some(phase) => phase.name(),
            None if self.phase & OFF != 0 => Phase::Off.name(),
            None => "unknown-code",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_stable_and_have_words() {
        let report = |phase| AdaptationReport { phase, ..AdaptationReport::default() };
        let words = [0, 1, 2, 3, 4, 5, 6, 7, 8, 0x81, 0xff].map(|phase| report(phase).word()).join(" ");
        assert_eq!(words, "watching moving settling trial frozen returning stopped off unknown-code off off");
        assert_eq!(report(0x85).why_off(), Some(Off::Settings));
        assert_eq!([0, 7, 8, 0x80].map(|phase| report(phase).why_off()), [None; 4]);
        let new = AdaptationReport::new(Phase::Trial, &Parameters::STORED, &Settings::TYPICAL, Plant::PAPER);
        assert_eq!((new.phase(), new.why_off()), (Some(Phase::Trial), None));
        assert_eq!((new.ratios, new.bounds, new.stored[0]), ([1.0; 3], [0.25, 0.25, 0.15], 5.5));
        let off = AdaptationReport::off(Off::ExtendedSpring, 7);
        assert_eq!((off.tick, off.phase(), off.why_off()), (7, None, Some(Off::ExtendedSpring)));
    }

    #[test]
    fn a_request_to_read_switches_nothing() {
        let requests = [Adaptation::Read, Adaptation::Off, Adaptation::On];
        assert_eq!(requests.map(Adaptation::switch), [None, Some(false), Some(true)]);
    }
}
