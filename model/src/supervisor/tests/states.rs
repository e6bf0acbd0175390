//! Arming, disarming, faults and their acknowledgement.

use super::*;

#[test]
fn nothing_leaves_before_arming() {
    let mut supervisor = Supervisor::new(config(), None);
    assert_eq!(tick(&mut supervisor, good()), (Decision::Rest, Drive::SAFE));
    assert_eq!(supervisor.state(), State::Disarmed);
}

#[test]
fn arming_starts_once_then_pursues_the_target() {
    let mut supervisor = Supervisor::new(config(), None);
    assert_eq!(tick(&mut supervisor, arm()).0, Decision::Start(volts(300.0)));
    let (decision, drive) = tick(&mut supervisor, arm());
    assert_eq!(decision, Decision::Pursue(volts(300.0)), "arming twice changes nothing");
    assert_eq!((drive.code(), drive.enabled(), supervisor.state()), (DacCode(1755), true, State::Armed));
}

#[test]
fn disarming_takes_the_voltage_away_in_the_same_tick() {
    let mut supervisor = armed();
    assert_eq!(tick(&mut supervisor, disarm()), (Decision::Rest, Drive::SAFE));
    assert_eq!(supervisor.state(), State::Disarmed);
    assert_eq!(tick(&mut supervisor, arm()).0, Decision::Start(volts(300.0)), "and it may be armed again");
}

#[test]
fn arming_is_refused_with_a_reason() {
    let refused = |supervisor: &mut Supervisor, inputs| {
        assert_eq!(tick(supervisor, inputs), (Decision::Rest, Drive::SAFE));
        supervisor.refusal()
    };
    let mut supervisor = Supervisor::new(config(), None);
    let open = Inputs { interlock_closed: false, ..arm() };
    assert_eq!(refused(&mut supervisor, open), Some(Refusal::InterlockOpen));
    let silent = Inputs { ticks_since_host: 501, ..arm() };
    assert_eq!(refused(&mut supervisor, silent), Some(Refusal::HostSilent));
    let mut supervisor = Supervisor::new(config(), Some(Fault::Panic));
    assert_eq!(refused(&mut supervisor, arm()), Some(Refusal::Faulted));
    assert_eq!(refused(&mut supervisor, good()), None, "a refusal belongs to its command");
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
fn a_fault_stays_until_acknowledged_and_then_needs_an_arm_of_its_own() {
    for fault in Fault::ALL {
        let mut supervisor = armed();
        let bad = Inputs { fault: Some(fault), ..good() };
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
fn the_first_fault_is_kept() {
    let mut supervisor = armed();
    tick(&mut supervisor, Inputs { interlock_closed: false, ..good() });
    tick(&mut supervisor, Inputs { fault: Some(Fault::Watchdog), ..good() });
    assert_eq!(supervisor.state(), State::Faulted(Fault::Interlock));
}

#[test]
fn a_disarm_of_the_same_tick_does_not_acknowledge_a_fault() {
    let mut supervisor = armed();
    tick(&mut supervisor, Inputs { interlock_closed: false, ..disarm() });
    assert_eq!(supervisor.state(), State::Faulted(Fault::Interlock));
    let mut supervisor = Supervisor::new(config(), None);
    tick(&mut supervisor, Inputs { fault: Some(Fault::Config), ..disarm() });
    assert_eq!(supervisor.state(), State::Faulted(Fault::Config));
}

#[test]
fn after_a_reset_by_a_fault_the_fault_still_stands() {
    let mut supervisor = Supervisor::new(config(), Some(Fault::HardFault));
    assert_eq!(tick(&mut supervisor, arm()).1, Drive::SAFE);
    assert_eq!(supervisor.state(), State::Faulted(Fault::HardFault));
}
