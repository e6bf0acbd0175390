use super::*;

#[test]
fn a_fault_survives_every_reset_and_stands_beside_a_dip_of_the_supply_or_the_watchdog() {
    let both = Faults::NONE.with(Fault::Panic).with(Fault::Interlock);
    let panic = CrashRecord::Faulted(Fault::Panic, both);
    for (reset, record, name, fault) in [
        (Reset::Supply, CrashRecord::None, "power-on", None),
        (Reset::Supply, CrashRecord::Running, "brown-out", Some(Fault::Supply)),
        (Reset::Supply, panic, "brown-out", Some(Fault::Panic)),
        (Reset::Watchdog, CrashRecord::Running, "watchdog", Some(Fault::Watchdog)),
        (Reset::Watchdog, panic, "watchdog", Some(Fault::Panic)),
        (Reset::Software, CrashRecord::Restart, "software", None),
        (Reset::Software, panic, "software", Some(Fault::Panic)),
        (Reset::Pin, CrashRecord::Running, "pin", None),
        (Reset::Pin, CrashRecord::Armed, "pin", Some(Fault::Supply)),
        (Reset::Pin, panic, "pin", Some(Fault::Panic)),
        (Reset::Other, CrashRecord::Armed, "other", Some(Fault::Supply)),
        (Reset::Other, panic, "other", Some(Fault::Panic)),
    ] {
        let stood = if record == panic { both } else { fault.map_or(Faults::NONE, |it| Faults::NONE.with(it)) };
        let standing = match reset {
            Reset::Supply if record != CrashRecord::None => stood.with(Fault::Supply),
            Reset::Watchdog => stood.with(Fault::Watchdog),
            _ => stood,
        };
        assert_eq!(reset_cause(Some(reset), record), Cause { name, fault, standing }, "{reset:?} {record:?}");
    }
}

#[test]
fn without_reset_flags_the_crash_record_determines_the_cause() {
    for (record, name, fault) in [
        (CrashRecord::None, "power-on", None),
        (CrashRecord::Restart, "software", None),
        (CrashRecord::Running, "watchdog", Some(Fault::Watchdog)),
        (CrashRecord::Armed, "watchdog", Some(Fault::Watchdog)),
        (CrashRecord::Faulted(Fault::Watchdog, Faults::NONE), "watchdog", Some(Fault::Watchdog)),
        (CrashRecord::Faulted(Fault::Panic, Faults::NONE), "software", Some(Fault::Panic)),
    ] {
        let cause = reset_cause(None, record);
        assert_eq!((cause.name, cause.fault), (name, fault), "{record:?}");
    }
}

#[test]
fn a_fault_between_the_request_to_restart_and_the_reset_is_kept() {
    assert_eq!(Record::RUNNING.with_restart().read(), CrashRecord::Restart);
    let faulted = Record::faulted(Fault::Interlock, Faults::NONE.with(Fault::Monitor));
    assert_eq!(faulted.with_restart(), faulted);
    let cause = reset_cause(Some(Reset::Software), faulted.with_restart().read());
    assert_eq!((cause.name, cause.fault), ("software", Some(Fault::Interlock)));
}

#[test]
fn a_panic_does_not_drop_the_faults_that_stand() {
    let both = Faults::NONE.with(Fault::Interlock).with(Fault::Panic);
    let record = Record::faulted(Fault::Interlock, Faults::NONE).with(Fault::Panic);
    assert_eq!(record.read(), CrashRecord::Faulted(Fault::Panic, both));
    let alone = CrashRecord::Faulted(Fault::Panic, Faults::NONE.with(Fault::Panic));
    assert_eq!(Record::RUNNING.with(Fault::Panic).read(), alone);
    assert_eq!(Record::RUNNING.with_restart().with(Fault::Panic).read(), alone);
}

#[test]
fn a_damaged_record_is_none() {
    let good = Record::faulted(Fault::Interlock, Faults::NONE);
    for damaged in [
        Record { mark: !MARK, ..good },
        Record { code: 5, ..good },
        Record { standing: 9, ..good },
        Record { check: 0, ..good },
    ] {
        assert_eq!(damaged.read(), CrashRecord::None, "{damaged:?}");
    }
    assert_eq!(Record::RUNNING.read(), CrashRecord::Running);
    for (state, record) in [(State::Disarmed, CrashRecord::Running), (State::Armed, CrashRecord::Armed)] {
        assert_eq!(Record::of(state, Faults::NONE).read(), record);
    }
}

/// Bits of a RAM that lost its supply for a moment.
#[test]
fn a_record_with_one_wrong_bit_is_none() {
    let standing = Faults::NONE.with(Fault::Monitor).with(Fault::Panic);
    let armed = Record::of(State::Armed, Faults::NONE);
    for good in [Record::RUNNING, armed, armed.with_restart(), Record::faulted(Fault::Interlock, standing)] {
        assert_ne!(good.read(), CrashRecord::None);
        for bit in (0..32).map(|bit| 1 << bit) {
            for damaged in [
                Record { mark: good.mark ^ bit, ..good },
                Record { code: good.code ^ bit, ..good },
                Record { standing: good.standing ^ bit, ..good },
                Record { check: good.check ^ bit, ..good },
            ] {
                assert_eq!(damaged.read(), CrashRecord::None, "{damaged:x?}");
            }
        }
    }
}
