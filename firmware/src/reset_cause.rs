//! Cause of the last reset, from the chip's reset flags and the crash record.
//!
//! The crash record survives every reset except a loss of its RAM's supply. After a short dip of the supply the program finds
//! the record of the previous run; after power-on it finds none.

use model::supervisor::Fault;

/// Content of the crash record at the start: how the previous run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrashRecord {
    /// No valid record: the supply was off.
    None,
    /// The program was running without a fault until a reset that it did not cause.
    Running,
    /// The host had requested a restart.
    Restart,
    /// Fault of the previous run in this tick, or an unacknowledged fault of an earlier run.
    Faulted(Fault, u32),
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

/// Name of the reset's cause for the log, and the fault behind it. Without reset flags (`None`) the source is derived from the
/// crash record.
pub fn reset_cause(reset: Option<Reset>, record: CrashRecord) -> (&'static str, Option<Fault>) {
    let recorded = match record {
        CrashRecord::Faulted(fault, _) => Some(fault),
        CrashRecord::None | CrashRecord::Running | CrashRecord::Restart => None,
    };
    let derived = match record {
        CrashRecord::None => Reset::Supply,
        CrashRecord::Running | CrashRecord::Faulted(Fault::Watchdog, _) => Reset::Watchdog,
        CrashRecord::Restart | CrashRecord::Faulted(..) => Reset::Software,
    };
    match (reset.unwrap_or(derived), record) {
        (Reset::Supply, CrashRecord::None | CrashRecord::Restart) => ("power-on", None),
        (Reset::Supply, _) => ("brown-out", recorded.or(Some(Fault::Supply))),
        (Reset::Watchdog, _) => ("watchdog", recorded.or(Some(Fault::Watchdog))),
        (Reset::Software, _) => ("software", recorded),
        (Reset::Pin, _) => ("pin", recorded),
        (Reset::Other, _) => ("other", recorded),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_survives_every_reset_and_a_supply_dip_is_a_fault() {
        let panic = CrashRecord::Faulted(Fault::Panic, 7);
        for (reset, record, name, fault) in [
            (Reset::Supply, CrashRecord::None, "power-on", None),
            (Reset::Supply, CrashRecord::Running, "brown-out", Some(Fault::Supply)),
            (Reset::Supply, panic, "brown-out", Some(Fault::Panic)),
            (Reset::Watchdog, CrashRecord::Running, "watchdog", Some(Fault::Watchdog)),
            (Reset::Watchdog, panic, "watchdog", Some(Fault::Panic)),
            (Reset::Software, CrashRecord::Restart, "software", None),
            (Reset::Software, panic, "software", Some(Fault::Panic)),
            (Reset::Pin, CrashRecord::Running, "pin", None),
            (Reset::Pin, panic, "pin", Some(Fault::Panic)),
            (Reset::Other, panic, "other", Some(Fault::Panic)),
        ] {
            assert_eq!(reset_cause(Some(reset), record), (name, fault), "{reset:?} {record:?}");
        }
    }

    #[test]
    fn without_reset_flags_the_crash_record_determines_the_cause() {
        for (record, name, fault) in [
            (CrashRecord::None, "power-on", None),
            (CrashRecord::Restart, "software", None),
            (CrashRecord::Running, "watchdog", Some(Fault::Watchdog)),
            (CrashRecord::Faulted(Fault::Watchdog, 7), "watchdog", Some(Fault::Watchdog)),
            (CrashRecord::Faulted(Fault::Panic, 7), "software", Some(Fault::Panic)),
        ] {
            assert_eq!(reset_cause(None, record), (name, fault), "{record:?}");
        }
    }
}
