//! Cause of the last reset, from the chip's reset flags and the crash record.
//!
//! The crash record survives every reset except a loss of its RAM's supply. After a short dip of the supply the program finds
//! the record of the previous run; after power-on it finds none.

use model::supervisor::{Fault, Faults, State};

/// "vsj2"
const MARK: u32 = 0x7673_6a32;
/// Code of [`CrashRecord::Running`].
const RUNNING: u32 = 0;
/// Code of [`CrashRecord::Armed`].
const ARMED: u32 = u32::MAX - 1;
/// Code of [`CrashRecord::Restart`].
const RESTART: u32 = u32::MAX;

/// Content of the crash record at the start: how the previous run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrashRecord {
    /// No valid record: the supply was off.
    None,
    /// The program was running without a fault until a reset that it did not cause.
    Running,
    /// The program was running without a fault, with its output enabled, until a reset that it did not cause.
    Armed,
    /// The host had requested a restart.
    Restart,
    /// The fault that the previous run showed or that stopped it, and all that stood at its end, this one among them.
    Faulted(Fault, Faults),
}

/// The crash record as it is stored. Every bit pattern is valid Rust; one that was not written as a record reads as
/// [`CrashRecord::None`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    mark: u32,
    code: u32,
    standing: u32,
    check: u32,
}

impl Record {
    /// The record of a running program without a fault.
    pub const RUNNING: Self = Self::new(RUNNING, Faults::NONE);

    /// The record of a program in `state`, while the faults `standing` stand.
    pub const fn of(state: State, standing: Faults) -> Self {
        let code = match state {
            State::Disarmed => RUNNING,
            State::Armed => ARMED,
            State::Faulted(fault) => fault.code() as u32,
        };
        Self::new(code, standing)
    }

    /// The record of a program that shows `fault` while the faults `standing` stand.
    pub const fn faulted(fault: Fault, standing: Faults) -> Self {
        Self::new(fault.code() as u32, standing.with(fault))
    }

    /// The record with a further `fault`, which is the one that stopped the program.
    pub fn with(self, fault: Fault) -> Self {
        match self.read() {
            CrashRecord::Faulted(_, standing) => Self::faulted(fault, standing),
            _ => Self::faulted(fault, Faults::NONE),
        }
    }

    /// The record before a reset that the host has requested: a fault that came after the request stays in it.
    pub fn with_restart(self) -> Self {
        match self.read() {
            CrashRecord::Faulted(..) => self,
            _ => Self::new(RESTART, Faults::NONE),
        }
    }

    /// How the program that has left this record ended.
    pub fn read(self) -> CrashRecord {
        let Self { mark, code, standing, check } = self;
        if mark != MARK || check != Self::check(code, standing) {
            return CrashRecord::None;
        }
        match u8::try_from(code).ok().and_then(Fault::from_code) {
            Some(fault) => CrashRecord::Faulted(fault, Faults::from_bits(standing as u16).with(fault)),
            None if code == RESTART => CrashRecord::Restart,
            None if code == ARMED => CrashRecord::Armed,
            None => CrashRecord::Running,
        }
    }

    const fn new(code: u32, standing: Faults) -> Self {
        let standing = standing.bits() as u32;
        Self { mark: MARK, code, standing, check: Self::check(code, standing) }
    }

    const fn check(code: u32, standing: u32) -> u32 {
        !(MARK ^ code.rotate_left(8) ^ standing)
    }
}

/// Source of a reset according to the chip's flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// The supply was switched on or has recovered.
    Supply,
    /// The hardware watchdog expired.
    Watchdog,
    /// The program requested the reset.
    Software,
    /// The reset pin was low.
    Pin,
    /// Any other source.
    Other,
}

/// Why the program was reset, and what stands since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cause {
    /// Name of the reset's cause for the log.
    pub name: &'static str,
    /// The fault that the previous run showed or that stopped it; without one, the fault that the reset is.
    pub fault: Option<Fault>,
    /// Both, and the earlier ones that nobody has acknowledged.
    pub standing: Faults,
}

/// The cause of a reset. Without reset flags (`None`) the source is derived from the crash record.
pub fn reset_cause(reset: Option<Reset>, record: CrashRecord) -> Cause {
    let (recorded, stood) = match record {
        CrashRecord::Faulted(fault, standing) => (Some(fault), standing),
        CrashRecord::None | CrashRecord::Running | CrashRecord::Armed | CrashRecord::Restart => (None, Faults::NONE),
    };
    let derived = match record {
        CrashRecord::None => Reset::Supply,
        CrashRecord::Running | CrashRecord::Armed | CrashRecord::Faulted(Fault::Watchdog, _) => Reset::Watchdog,
        CrashRecord::Restart | CrashRecord::Faulted(..) => Reset::Software,
    };
    let (name, of_reset) = match (reset.unwrap_or(derived), record) {
        (Reset::Supply, CrashRecord::None | CrashRecord::Restart) => ("power-on", None),
        (Reset::Supply, _) => ("brown-out", Some(Fault::Supply)),
        (Reset::Watchdog, _) => ("watchdog", Some(Fault::Watchdog)),
        (Reset::Software, _) => ("software", None),
        // As after a dip of the supply, the spring may be charged, which the estimator does not know.
        (Reset::Pin, CrashRecord::Armed) => ("pin", Some(Fault::Supply)),
        (Reset::Other, CrashRecord::Armed) => ("other", Some(Fault::Supply)),
        (Reset::Pin, _) => ("pin", None),
        (Reset::Other, _) => ("other", None),
    };
    // A fault that stood already does not hide the one that the reset is.
    let standing = [recorded, of_reset].into_iter().flatten().fold(stood, Faults::with);
    Cause { name, fault: recorded.or(of_reset), standing }
}

#[cfg(test)]
mod tests;
