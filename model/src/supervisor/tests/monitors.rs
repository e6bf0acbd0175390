//! An amplifier that does not do what it is told.

use super::*;

/// With monitors that say this.
fn says(voltage_v: f64, current_ua: i32, inputs: Inputs) -> Inputs {
    Inputs { monitors: Some(Monitors { voltage: volts(voltage_v), current_ua }), ..inputs }
}

/// Ticks of the same; the state after them.
fn ticks(supervisor: &mut Supervisor, number: u32, inputs: Inputs) -> State {
    for _ in 0..number {
        tick(supervisor, inputs);
    }
    supervisor.state()
}

#[test]
fn monitors_may_disagree_for_a_while_only() {
    for bad in [says(200.0, 0, good()), says(300.0, 2001, good()), says(300.0, i32::MIN, good())] {
        let mut supervisor = armed();
        assert_eq!(ticks(&mut supervisor, 50, bad), State::Armed);
        assert_eq!(ticks(&mut supervisor, 1, bad), State::Faulted(Fault::Monitor));
    }
    let mut supervisor = armed();
    for _ in 0..100 {
        ticks(&mut supervisor, 49, says(200.0, 0, good()));
        ticks(&mut supervisor, 1, says(299.0, -1999, good()));
    }
    assert_eq!(supervisor.state(), State::Armed, "never long enough in one piece");
}

/// From the tick that takes the voltage away, a second; whatever the monitors said before.
#[test]
fn a_voltage_that_stays_is_a_fault_after_its_time_to_discharge() {
    let mut supervisor = armed();
    ticks(&mut supervisor, 49, says(500.0, 0, good()));
    tick(&mut supervisor, says(500.0, 0, disarm()));
    for _ in 0..2 {
        assert_eq!(ticks(&mut supervisor, 1000, says(500.0, 0, good())), State::Disarmed);
        ticks(&mut supervisor, 1, says(35.0, 0, good()));
    }
    assert_eq!(ticks(&mut supervisor, 1001, says(0.0, -2001, good())), State::Faulted(Fault::Monitor));
    let mut never_armed = Supervisor::new(config(), None);
    assert_eq!(ticks(&mut never_armed, 1001, says(500.0, 0, good())), State::Faulted(Fault::Monitor));
}

#[test]
fn nothing_is_armed_while_a_voltage_stays() {
    let mut supervisor = armed();
    tick(&mut supervisor, says(300.0, 0, disarm()));
    for left_v in [300.0, 100.0, 36.0] {
        assert_eq!(tick(&mut supervisor, says(left_v, 0, arm())).1, Drive::SAFE);
        assert_eq!((supervisor.state(), supervisor.refusal()), (State::Disarmed, Some(Refusal::Live)), "{left_v} V");
    }
    assert_eq!(ticks(&mut supervisor, 1, says(35.0, 0, arm())), State::Armed);
    assert_eq!(supervisor.refusal(), None);
}

#[test]
fn nothing_is_acknowledged_while_a_voltage_stays() {
    for fault in [Fault::Panic, Fault::Monitor] {
        let mut supervisor = Supervisor::new(config(), Some(fault));
        assert_eq!(
            ticks(&mut supervisor, 2000, says(500.0, 0, disarm())),
            State::Faulted(fault),
            "the first one stays"
        );
        assert_eq!(supervisor.refusal(), Some(Refusal::Live));
        assert_eq!(ticks(&mut supervisor, 1, says(0.0, 0, disarm())), State::Disarmed);
        assert_eq!(supervisor.refusal(), None);
    }
    let mut supervisor = armed();
    assert_eq!(ticks(&mut supervisor, 1, says(500.0, 0, disarm())), State::Disarmed, "it is taken away all the same");
}
