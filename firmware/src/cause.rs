//! Why the chip was reset: from what it says itself, and from what the last run left.
//!
//! The memory outlives every reset but the loss of its power. A program that was running when the supply dipped for a moment
//! finds its own record, one that was switched on finds none.

use model::supervisor::Fault;

/// What the last run left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legacy {
    /// Nothing: the power was off.
    None,
    /// It was running until a reset that it did not cause.
    Silent,
    /// It was told to.
    Told,
    /// A fault of this tick, or of an earlier run, that nobody had acknowledged.
    Faulted(Fault, u32),
}

/// What the chip says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// The supply came, or came back.
    Supply,
    /// The watchdog.
    Watchdog,
    /// The program.
    Software,
    /// The reset pin.
    Pin,
    /// Anything else.
    Other,
}

/// The cause's name, and the fault behind it. A chip that does not say was reset by what leaves such a legacy.
pub fn cause(reset: Option<Reset>, legacy: Legacy) -> (&'static str, Option<Fault>) {
    let left = match legacy {
        Legacy::Faulted(fault, _) => Some(fault),
        Legacy::None | Legacy::Silent | Legacy::Told => None,
    };
    let usual = match legacy {
        Legacy::None => Reset::Supply,
        Legacy::Silent | Legacy::Faulted(Fault::Watchdog, _) => Reset::Watchdog,
        Legacy::Told | Legacy::Faulted(..) => Reset::Software,
    };
    match (reset.unwrap_or(usual), legacy) {
        (Reset::Supply, Legacy::None | Legacy::Told) => ("power-on", None),
        (Reset::Supply, _) => ("brown-out", left.or(Some(Fault::Supply))),
        (Reset::Watchdog, _) => ("watchdog", left.or(Some(Fault::Watchdog))),
        (Reset::Software, _) => ("software", left),
        (Reset::Pin, _) => ("pin", left),
        (Reset::Other, _) => ("other", left),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_outlives_every_reset_and_a_dip_of_the_supply_is_one() {
        let panic = Legacy::Faulted(Fault::Panic, 7);
        for (reset, legacy, name, fault) in [
            (Reset::Supply, Legacy::None, "power-on", None),
            (Reset::Supply, Legacy::Silent, "brown-out", Some(Fault::Supply)),
            (Reset::Supply, panic, "brown-out", Some(Fault::Panic)),
            (Reset::Watchdog, Legacy::Silent, "watchdog", Some(Fault::Watchdog)),
            (Reset::Watchdog, panic, "watchdog", Some(Fault::Panic)),
            (Reset::Software, Legacy::Told, "software", None),
            (Reset::Software, panic, "software", Some(Fault::Panic)),
            (Reset::Pin, Legacy::Silent, "pin", None),
            (Reset::Pin, panic, "pin", Some(Fault::Panic)),
            (Reset::Other, panic, "other", Some(Fault::Panic)),
        ] {
            assert_eq!(cause(Some(reset), legacy), (name, fault), "{reset:?} {legacy:?}");
        }
    }

    #[test]
    fn where_the_chip_does_not_say_the_legacy_does() {
        for (legacy, name, fault) in [
            (Legacy::None, "power-on", None),
            (Legacy::Told, "software", None),
            (Legacy::Silent, "watchdog", Some(Fault::Watchdog)),
            (Legacy::Faulted(Fault::Watchdog, 7), "watchdog", Some(Fault::Watchdog)),
            (Legacy::Faulted(Fault::Panic, 7), "software", Some(Fault::Panic)),
        ] {
            assert_eq!(cause(None, legacy), (name, fault), "{legacy:?}");
        }
    }
}
