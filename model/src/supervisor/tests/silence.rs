//! A host that sends no more frames.

use super::*;

/// 0.5 s of timeout, then from 300 V at 700 V/s: 428 ticks on the ramp.
#[test]
fn a_silent_host_leads_to_a_ramp_to_zero_and_a_disarm() {
    let mut supervisor = armed();
    let mut silent = good();
    for ticks in 1..=500 {
        silent.ticks_since_host = ticks;
        assert_eq!(tick(&mut supervisor, silent).0, Decision::Pursue(volts(300.0)));
    }
    let mut before = volts(300.0);
    for ticks in 501..=928 {
        silent.ticks_since_host = ticks;
        let (decision, drive) = tick(&mut supervisor, silent);
        let Decision::Pursue(target) = decision else { panic!("{ticks}: {decision:?}") };
        assert!(target < before && target > Volts::ZERO && drive.enabled(), "{ticks}: {target:?}");
        assert!(supervisor.ramping());
        before = target;
    }
    silent.ticks_since_host = 929;
    assert_eq!(tick(&mut supervisor, silent), (Decision::Rest, Drive::SAFE));
    assert_eq!(supervisor.state(), State::Disarmed, "a silent host is not a fault");
    assert_eq!(tick(&mut supervisor, good()).1, Drive::SAFE, "the host has to arm again");
}

#[test]
fn a_host_that_returns_during_the_ramp_keeps_the_output_enabled() {
    let mut supervisor = armed();
    tick(&mut supervisor, good());
    for ticks in 501..600 {
        tick(&mut supervisor, Inputs { ticks_since_host: ticks, ..good() });
    }
    assert!(supervisor.ramping());
    assert_eq!(tick(&mut supervisor, good()).0, Decision::Pursue(volts(300.0)));
    assert!(!supervisor.ramping());
}

#[test]
fn an_open_interlock_is_a_fault_while_the_host_is_silent() {
    let mut supervisor = armed();
    let silent = Inputs { ticks_since_host: 550, ..good() };
    tick(&mut supervisor, silent);
    tick(&mut supervisor, Inputs { interlock_closed: false, ..silent });
    assert_eq!(supervisor.state(), State::Faulted(Fault::Interlock));
    assert!(!supervisor.ramping());
}

/// The slowest ramp is 10 V/s at 10 kHz, 1 mV per tick.
#[test]
fn the_slowest_ramp_falls_at_its_nominal_rate() {
    let settings = Settings { ramp_v_per_s: 10.0, ..Settings::DEFAULT };
    let config = settings.validate(SampleTime::from_rate(10_000.0).unwrap()).unwrap().quantize();
    let mut supervisor = Supervisor::new(config, None);
    tick(&mut supervisor, arm());
    let silent = Inputs { ticks_since_host: u32::MAX, ..good() };
    for _ in 0..10_000 {
        tick(&mut supervisor, silent);
    }
    let Decision::Pursue(target) = supervisor.decide(&silent) else { panic!("{supervisor:?}") };
    assert!((target.to_f64() - 290.0).abs() < 2e-3, "{target:?}");
}

#[test]
fn a_negative_target_ends_its_ramp_in_one_tick() {
    let mut supervisor = armed();
    tick(&mut supervisor, Inputs { target: volts(-10.0), ..good() });
    tick(&mut supervisor, Inputs { ticks_since_host: 501, target: volts(-10.0), ..good() });
    assert_eq!(supervisor.state(), State::Disarmed);
}

#[test]
fn a_ramp_that_reaches_exactly_zero_disarms_in_that_tick() {
    let settings = Settings { ramp_v_per_s: 1000.0, ..Settings::DEFAULT };
    let config = settings.validate(SampleTime::from_rate(RATE_HZ).unwrap()).unwrap().quantize();
    let mut supervisor = Supervisor::new(config, None);
    tick(&mut supervisor, Inputs { target: volts(3.0), ..arm() });
    let silent = Inputs { ticks_since_host: 501, ..good() };
    let targets = [2.0, 1.0].map(|left_v| (supervisor.decide(&silent), Decision::Pursue(volts(left_v))));
    assert!(targets.iter().all(|(is, expected)| is == expected), "{targets:?}");
    assert_eq!((supervisor.decide(&silent), supervisor.state()), (Decision::Rest, State::Disarmed));
}

/// A target of 1000 V that the controller limits to 700 V.
#[test]
fn the_ramp_begins_at_the_target_that_the_controller_has_limited() {
    let mut supervisor = armed();
    let beyond = Inputs { target: volts(1000.0), ..good() };
    supervisor.decide(&beyond);
    supervisor.release(&output(700.0));
    let silent = |ticks: u32| Inputs { ticks_since_host: 500 + ticks, ..beyond };
    for ticks in 1..1000 {
        let Decision::Pursue(target) = supervisor.decide(&silent(ticks)) else { panic!("{ticks}: {supervisor:?}") };
        assert!((target.to_f64() - (700.0 - 0.7 * f64::from(ticks))).abs() < 1e-3, "{ticks}: {target:?}");
        supervisor.release(&Output { target, ..output(300.0) });
    }
    supervisor.decide(&silent(1000));
    supervisor.decide(&silent(1001));
    assert_eq!(supervisor.state(), State::Disarmed, "after one second, give or take a rounding");
}
