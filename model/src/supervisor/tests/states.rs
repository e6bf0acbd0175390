//! Arming, disarming, faults and their acknowledgement.

use super::*;

#[test]
fn the_safe_output_is_code_0_with_the_amplifier_off() {
    assert_eq!((Drive::SAFE.code(), Drive::SAFE.enabled()), (DacCode(0), false));
}

#[test]
fn the_output_is_disabled_before_arming() {
    let mut supervisor = Supervisor::new(config(), None);
    assert_eq!(tick(&mut supervisor, good()), (Decision::Rest, Drive::SAFE));
    assert_eq!(supervisor.state(), State::Disarmed);
}

#[test]
fn arming_starts_once_and_then_pursues_the_target() {
    let mut supervisor = Supervisor::new(config(), None);
    assert_eq!(tick(&mut supervisor, arm()).0, Decision::Start(volts(300.0)));
    let (decision, drive) = tick(&mut supervisor, arm());
    assert_eq!(decision, Decision::Pursue(volts(300.0)), "arming twice changes nothing");
    assert_eq!((drive.code(), drive.enabled(), supervisor.state()), (DacCode(1755), true, State::Armed));
}

#[test]
fn disarming_disables_the_output_in_the_same_tick() {
    let mut supervisor = armed();
    assert_eq!(tick(&mut supervisor, disarm()), (Decision::Rest, Drive::SAFE));
    assert_eq!(supervisor.state(), State::Disarmed);
    assert_eq!(tick(&mut supervisor, arm()).0, Decision::Start(volts(300.0)), "it can be armed again");
}

#[test]
fn arming_is_rejected_with_a_reason() {
    let rejected = |supervisor: &mut Supervisor, inputs| {
        assert_eq!(tick(supervisor, inputs), (Decision::Rest, Drive::SAFE));
        supervisor.refusal()
    };
    let mut supervisor = Supervisor::new(config(), None);
    let open = Inputs { interlock_closed: false, ..arm() };
    assert_eq!(rejected(&mut supervisor, open), Some(Refusal::InterlockOpen));
    let silent = Inputs { ticks_since_host: 501, ..arm() };
    assert_eq!(rejected(&mut supervisor, silent), Some(Refusal::HostSilent));
    let mut supervisor = Supervisor::new(config(), Some(Fault::Panic));
    assert_eq!(rejected(&mut supervisor, arm()), Some(Refusal::Faulted));
    assert_eq!(rejected(&mut supervisor, good()), None, "a rejection lasts for one tick");
}

#[test]
fn an_open_interlock_is_a_fault_only_while_armed() {
    let open = Inputs { interlock_closed: false, ..good() };
    let mut supervisor = Supervisor::new(config(), None);
    tick(&mut supervisor, open);
    assert_eq!(supervisor.state(), State::Disarmed);
    let mut supervisor = armed();
    assert_eq!(tick(&mut supervisor, open), (Decision::Rest, Drive::SAFE));
    assert_eq!(supervisor.state(), State::Faulted(Fault::Interlock));
}

#[test]
fn a_fault_stays_until_it_is_acknowledged_and_arming_needs_another_command() {
    for fault in Fault::ALL {
        let mut supervisor = armed();
        let bad = Inputs { faults: Faults::NONE.with(fault), ..good() };
        assert_eq!(tick(&mut supervisor, bad), (Decision::Rest, Drive::SAFE), "in the same tick");
        for _ in 0..10_000 {
            assert_eq!(tick(&mut supervisor, arm()).1, Drive::SAFE);
        }
        assert_eq!(supervisor.state(), State::Faulted(fault));
        tick(&mut supervisor, disarm());
        assert_eq!(supervisor.state(), State::Disarmed);
        assert_eq!(tick(&mut supervisor, good()).1, Drive::SAFE);
        assert!(tick(&mut supervisor, arm()).1.enabled());
    }
}

#[test]
fn a_second_fault_is_neither_lost_nor_cleared_by_one_acknowledgement() {
    let both = Faults::NONE.with(Fault::Interlock).with(Fault::Panic);
    let mut supervisor = armed();
    tick(&mut supervisor, Inputs { interlock_closed: false, ..good() });
    tick(&mut supervisor, Inputs { faults: Faults::NONE.with(Fault::Panic), ..good() });
    assert_eq!(supervisor.state(), State::Faulted(Fault::Interlock), "the first one is shown");
    assert_eq!(supervisor.standing(), both);
    tick(&mut supervisor, disarm());
    assert_eq!(supervisor.state(), State::Faulted(Fault::Panic));
    assert_eq!((tick(&mut supervisor, arm()).1, supervisor.refusal()), (Drive::SAFE, Some(Refusal::Faulted)));
    tick(&mut supervisor, disarm());
    assert_eq!((supervisor.state(), supervisor.standing()), (State::Disarmed, Faults::NONE));
    assert!(tick(&mut supervisor, arm()).1.enabled());
}

#[test]
fn faults_of_the_same_tick_all_stand() {
    let mut supervisor = armed();
    let both =
        Inputs { interlock_closed: false, missed_ticks: 6, faults: Faults::NONE.with(Fault::Watchdog), ..good() };
    tick(&mut supervisor, both);
    assert_eq!(supervisor.state(), State::Faulted(Fault::Watchdog));
    assert!(supervisor.standing().iter().eq([Fault::Overrun, Fault::Interlock, Fault::Watchdog]));
}

#[test]
fn a_fault_is_not_acknowledged_while_its_cause_is_there() {
    for (fault, refusal) in [
        (Fault::Interlock, Refusal::InterlockOpen),
        (Fault::Watchdog, Refusal::CausePresent),
        (Fault::Overrun, Refusal::CausePresent),
    ] {
        let with_cause = |inputs| match fault {
            Fault::Interlock => Inputs { interlock_closed: false, ..inputs },
            Fault::Overrun => Inputs { missed_ticks: 6, ..inputs },
            _ => Inputs { faults: Faults::NONE.with(fault), ..inputs },
        };
        let mut supervisor = armed();
        tick(&mut supervisor, with_cause(good()));
        for _ in 0..100 {
            tick(&mut supervisor, with_cause(disarm()));
            assert_eq!((supervisor.state(), supervisor.refusal()), (State::Faulted(fault), Some(refusal)));
        }
        // A missed tick is forgotten after a second.
        for _ in 0..999 {
            tick(&mut supervisor, good());
        }
        assert_eq!(supervisor.state(), State::Faulted(fault), "that the cause is gone is not enough");
        tick(&mut supervisor, disarm());
        assert_eq!((supervisor.state(), supervisor.refusal()), (State::Disarmed, None), "{fault:?}");
    }
}

/// A fault with a lower number is reported as well.
#[test]
fn no_other_reported_fault_hides_a_cause_that_is_there() {
    let with = |inputs, faults: [Fault; 2]| Inputs { faults: faults.into_iter().collect(), ..inputs };
    let mut supervisor = Supervisor::new(config(), Some(Fault::SelfTest));
    tick(&mut supervisor, with(good(), [Fault::Watchdog, Fault::SelfTest]));
    assert!(supervisor.standing().iter().eq([Fault::Watchdog, Fault::SelfTest]));
    tick(&mut supervisor, with(disarm(), [Fault::Watchdog, Fault::SelfTest]));
    assert_eq!(supervisor.state(), State::Faulted(Fault::SelfTest));
    assert_eq!(supervisor.refusal(), Some(Refusal::CausePresent));
}

#[test]
fn a_disarm_of_the_same_tick_does_not_acknowledge_a_fault() {
    let mut supervisor = armed();
    tick(&mut supervisor, Inputs { interlock_closed: false, ..disarm() });
    assert_eq!(supervisor.state(), State::Faulted(Fault::Interlock));
    let mut supervisor = armed();
    tick(&mut supervisor, Inputs { missed_ticks: 6, ..disarm() });
    assert_eq!(supervisor.state(), State::Faulted(Fault::Overrun));
    let mut supervisor = Supervisor::new(config(), None);
    tick(&mut supervisor, Inputs { faults: Faults::NONE.with(Fault::Config), ..disarm() });
    assert_eq!(supervisor.state(), State::Faulted(Fault::Config));
}

#[test]
fn the_fault_that_caused_a_reset_is_kept_after_it() {
    let mut supervisor = Supervisor::new(config(), Some(Fault::HardFault));
    assert_eq!(supervisor.standing(), Faults::NONE.with(Fault::HardFault));
    assert_eq!(tick(&mut supervisor, arm()).1, Drive::SAFE);
    assert_eq!(supervisor.state(), State::Faulted(Fault::HardFault));
}

/// Code that forgets to read the interlock must not be able to arm.
#[test]
fn inputs_that_nobody_has_filled_in_cannot_enable_the_output() {
    let arm = Some(Command::Arm);
    for (inputs, refusal) in [
        (Inputs { command: arm, ticks_since_host: 0, ..Inputs::default() }, Refusal::InterlockOpen),
        (Inputs { command: arm, interlock_closed: true, ..Inputs::default() }, Refusal::HostSilent),
    ] {
        let mut supervisor = Supervisor::new(config(), None);
        assert_eq!((tick(&mut supervisor, inputs).1, supervisor.refusal()), (Drive::SAFE, Some(refusal)));
    }
}

#[test]
fn limits_are_reported_only_while_armed() {
    let limited = Output { limits: Limits::UPPER, ..output(300.0) };
    let mut supervisor = armed();
    assert_eq!(supervisor.limits(&limited), Limits::UPPER);
    tick(&mut supervisor, disarm());
    assert_eq!(supervisor.limits(&limited), Limits::NONE);
    let faulted = Supervisor::new(config(), Some(Fault::Panic));
    assert_eq!(faulted.limits(&limited), Limits::NONE);
}
