//! An amplifier whose monitors disagree with the output.

use super::*;

/// Adds these readings of the monitors to the inputs.
fn reading(voltage_v: f64, current_ua: i32, inputs: Inputs) -> Inputs {
    Inputs { monitors: Some(Monitors { voltage: volts(voltage_v), current_ua }), ..inputs }
}

/// Runs ticks with the same inputs; returns the state after them.
fn ticks(supervisor: &mut Supervisor, number: u32, inputs: Inputs) -> State {
    for _ in 0..number {
        tick(supervisor, inputs);
    }
    supervisor.state()
}

#[test]
fn a_disagreement_of_more_than_50_ms_is_a_fault() {
    for bad in [reading(200.0, 0, good()), reading(300.0, 2001, good()), reading(300.0, i32::MIN, good())] {
        let mut supervisor = armed();
        assert_eq!(ticks(&mut supervisor, 50, bad), State::Armed);
        assert_eq!(ticks(&mut supervisor, 1, bad), State::Faulted(Fault::Monitor));
    }
    let mut supervisor = armed();
    for _ in 0..100 {
        ticks(&mut supervisor, 49, reading(200.0, 0, good()));
        ticks(&mut supervisor, 1, reading(299.0, -1999, good()));
    }
    assert_eq!(supervisor.state(), State::Armed, "no single disagreement is long enough");
}

/// The second begins with the tick that disables the output, whatever the monitors read before.
#[test]
fn a_voltage_that_stays_for_more_than_the_discharge_time_is_a_fault() {
    let mut supervisor = armed();
    ticks(&mut supervisor, 49, reading(500.0, 0, good()));
    tick(&mut supervisor, reading(500.0, 0, disarm()));
    for _ in 0..2 {
        assert_eq!(ticks(&mut supervisor, 1000, reading(500.0, 0, good())), State::Disarmed);
        ticks(&mut supervisor, 1, reading(35.0, 0, good()));
    }
    assert_eq!(ticks(&mut supervisor, 1001, reading(0.0, -2001, good())), State::Faulted(Fault::Monitor));
    let mut never_armed = Supervisor::new(config(), None);
    assert_eq!(ticks(&mut never_armed, 1001, reading(500.0, 0, good())), State::Faulted(Fault::Monitor));
}

#[test]
fn arming_is_rejected_while_the_amplifier_holds_a_voltage() {
    let mut supervisor = armed();
    tick(&mut supervisor, reading(300.0, 0, disarm()));
    for left_v in [300.0, 100.0, 36.0] {
        assert_eq!(tick(&mut supervisor, reading(left_v, 0, arm())).1, Drive::SAFE);
        assert_eq!((supervisor.state(), supervisor.refusal()), (State::Disarmed, Some(Refusal::Live)), "{left_v} V");
    }
    assert_eq!(ticks(&mut supervisor, 1, reading(35.0, 0, arm())), State::Armed);
    assert_eq!(supervisor.refusal(), None);
}

#[test]
fn an_acknowledgement_is_rejected_while_the_amplifier_holds_a_voltage() {
    for fault in [Fault::Panic, Fault::Monitor] {
        let mut supervisor = Supervisor::new(config(), Some(fault));
        assert_eq!(
            ticks(&mut supervisor, 2000, reading(500.0, 0, disarm())),
            State::Faulted(fault),
            "the first fault is shown"
        );
        assert_eq!(supervisor.refusal(), Some(Refusal::Live));
        if fault != Fault::Monitor {
            assert_eq!(ticks(&mut supervisor, 1, reading(0.0, 0, disarm())), State::Faulted(Fault::Monitor));
        }
        assert_eq!(ticks(&mut supervisor, 1, reading(0.0, 0, disarm())), State::Disarmed);
        assert_eq!(supervisor.refusal(), None);
    }
    let mut supervisor = armed();
    assert_eq!(
        ticks(&mut supervisor, 1, reading(500.0, 0, disarm())),
        State::Disarmed,
        "disarming is never rejected while armed"
    );
}

#[test]
fn readings_at_the_tolerance_agree() {
    let mut supervisor = armed();
    for (voltage_v, current_ua) in [(335.0, 2000), (265.0, -2000)] {
        assert_eq!(ticks(&mut supervisor, 100, reading(voltage_v, current_ua, good())), State::Armed);
    }
}
