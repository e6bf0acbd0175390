//! Every way in and out of every state.

use super::*;
use crate::amplifier::Limits;
use crate::units::{SampleTime, ScaledStiffness};
use proptest::prelude::*;

const RATE_HZ: f64 = 1000.0;

fn config() -> Config {
    Settings::DEFAULT.check(SampleTime::from_rate(RATE_HZ).unwrap()).unwrap()
}

fn volts(value: f64) -> Volts {
    Volts::new(value).unwrap()
}

/// Nothing wrong, host just heard, 300 V wanted.
fn good() -> Inputs {
    Inputs { ticks_since_host: 0, interlock_closed: true, target: volts(300.0), ..Inputs::default() }
}

fn arm() -> Inputs {
    Inputs { command: Some(Command::Arm), ..good() }
}

fn disarm() -> Inputs {
    Inputs { command: Some(Command::Disarm), ..good() }
}

fn output(applied_v: f64) -> Output {
    let applied = volts(applied_v);
    Output {
        target: applied,
        voltage: applied,
        code: DacCode(1755),
        applied,
        stiffness: ScaledStiffness::default(),
        limits: Limits::NONE,
        sensor: None,
    }
}

/// A whole tick; the controller always offers 300 V.
fn tick(supervisor: &mut Supervisor, inputs: Inputs) -> (Decision, Drive) {
    let decision = supervisor.decide(&inputs);
    (decision, supervisor.release(&output(300.0)))
}

fn armed() -> Supervisor {
    let mut supervisor = Supervisor::new(config(), None);
    assert_eq!(tick(&mut supervisor, arm()).0, Decision::Start(volts(300.0)));
    supervisor
}

#[test]
fn nothing_leaves_before_arming() {
    let mut supervisor = Supervisor::new(config(), None);
    assert_eq!(tick(&mut supervisor, good()), (Decision::Rest, Drive::SAFE));
    assert_eq!(supervisor.label(), "disarmed");
}

#[test]
fn arming_starts_once_then_pursues_the_target() {
    let mut supervisor = Supervisor::new(config(), None);
    assert_eq!(tick(&mut supervisor, arm()).0, Decision::Start(volts(300.0)));
    let (decision, drive) = tick(&mut supervisor, arm());
    assert_eq!(decision, Decision::Pursue(volts(300.0)), "arming twice changes nothing");
    assert_eq!((drive.code(), drive.enabled(), supervisor.label()), (DacCode(1755), true, "armed"));
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
    assert_eq!(supervisor.label(), "faulted");
}

/// 0.5 s of patience, then 300 V at 700 V/s: 428 ticks on the ramp.
#[test]
fn a_silent_host_is_followed_by_a_ramp_to_zero_and_a_disarm() {
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
        assert_eq!(supervisor.label(), "ramping");
        before = target;
    }
    silent.ticks_since_host = 929;
    assert_eq!(tick(&mut supervisor, silent), (Decision::Rest, Drive::SAFE));
    assert_eq!(supervisor.state(), State::Disarmed, "silence is no fault");
    assert_eq!(tick(&mut supervisor, good()).1, Drive::SAFE, "a host that is back has to arm");
}

#[test]
fn a_host_that_comes_back_on_the_ramp_goes_on() {
    let mut supervisor = armed();
    tick(&mut supervisor, good());
    for ticks in 501..600 {
        tick(&mut supervisor, Inputs { ticks_since_host: ticks, ..good() });
    }
    assert!(supervisor.ramping());
    assert_eq!(tick(&mut supervisor, good()).0, Decision::Pursue(volts(300.0)));
    assert_eq!(supervisor.label(), "armed");
}

#[test]
fn a_silent_host_does_not_hide_an_open_interlock() {
    let mut supervisor = armed();
    let silent = Inputs { ticks_since_host: 550, ..good() };
    tick(&mut supervisor, silent);
    tick(&mut supervisor, Inputs { interlock_closed: false, ..silent });
    assert_eq!(supervisor.state(), State::Faulted(Fault::Interlock));
    assert!(!supervisor.ramping());
}

/// The slowest ramp, 10 V/s at 10 kHz, is 1 mV a tick.
#[test]
fn the_slowest_ramp_keeps_its_rate() {
    let settings = Settings { ramp_v_per_s: 10.0, ..Settings::DEFAULT };
    let config = settings.check(SampleTime::from_rate(10_000.0).unwrap()).unwrap();
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
fn a_target_below_zero_is_at_the_end_of_its_ramp() {
    let mut supervisor = armed();
    tick(&mut supervisor, Inputs { target: volts(-10.0), ..good() });
    tick(&mut supervisor, Inputs { ticks_since_host: 501, target: volts(-10.0), ..good() });
    assert_eq!(supervisor.state(), State::Disarmed);
}

#[test]
fn few_missed_ticks_are_forgiven_and_forgotten_many_are_a_fault() {
    let miss = |missed_ticks| Inputs { missed_ticks, ..good() };
    let mut supervisor = armed();
    tick(&mut supervisor, miss(5));
    assert_eq!(supervisor.state(), State::Armed);
    tick(&mut supervisor, miss(1));
    assert_eq!(supervisor.state(), State::Faulted(Fault::Overrun));

    let mut supervisor = armed();
    for _ in 0..50 {
        tick(&mut supervisor, miss(1));
        for _ in 0..999 {
            tick(&mut supervisor, good());
        }
    }
    assert_eq!(supervisor.state(), State::Armed, "one a second goes on for ever");

    let mut supervisor = armed();
    tick(&mut supervisor, miss(u32::MAX));
    assert_eq!(supervisor.state(), State::Faulted(Fault::Overrun));
    tick(&mut supervisor, disarm());
    tick(&mut supervisor, arm());
    tick(&mut supervisor, good());
    assert_eq!(supervisor.state(), State::Armed, "what is acknowledged is forgotten");
}

#[test]
fn monitors_may_disagree_for_a_while_only() {
    let reads = |voltage, current_ua| Inputs { monitors: Some(Monitors { voltage, current_ua }), ..good() };
    for bad in [reads(volts(200.0), 0), reads(volts(300.0), 2001), reads(volts(300.0), i32::MIN)] {
        let mut supervisor = armed();
        for _ in 0..50 {
            tick(&mut supervisor, bad);
        }
        assert_eq!(supervisor.state(), State::Armed);
        tick(&mut supervisor, bad);
        assert_eq!(supervisor.state(), State::Faulted(Fault::Monitor));
    }
    let mut supervisor = armed();
    for _ in 0..100 {
        for _ in 0..49 {
            tick(&mut supervisor, reads(volts(200.0), 0));
        }
        tick(&mut supervisor, reads(volts(299.0), -1999));
    }
    assert_eq!(supervisor.state(), State::Armed, "never long enough in one piece");
}

#[test]
fn codes_lead_back_to_their_faults() {
    for fault in Fault::ALL {
        assert_eq!(Fault::from_code(fault.code()), Some(fault));
    }
    assert_eq!((Fault::from_code(0), Fault::from_code(8)), (None, None));
    assert_eq!(Fault::ALL.map(Fault::code), [1, 2, 3, 4, 5, 6, 7], "these numbers are a promise");
}

#[test]
fn wrong_settings_are_named() {
    let good = Settings::DEFAULT;
    for (field, wrong) in [
        ("host_timeout_s", Settings { host_timeout_s: 0.0, ..good }),
        ("host_timeout_s", Settings { host_timeout_s: f64::NAN, ..good }),
        ("ramp_v_per_s", Settings { ramp_v_per_s: -1.0, ..good }),
        ("missed_ticks_allowed", Settings { missed_ticks_allowed: 0, ..good }),
        ("forget_missed_s", Settings { forget_missed_s: 61.0, ..good }),
        ("monitor_tolerance_v", Settings { monitor_tolerance_v: 0.0, ..good }),
        ("max_current_a", Settings { max_current_a: 2.0, ..good }),
        ("monitor_time_s", Settings { monitor_time_s: 0.0, ..good }),
    ] {
        assert_eq!(wrong.check(SampleTime::from_rate(RATE_HZ).unwrap()).unwrap_err().field, field, "{wrong:?}");
    }
}

fn any_inputs() -> impl Strategy<Value = Inputs> {
    let command = prop_oneof![
        6 => Just(None), 3 => Just(Some(Command::Arm)), 1 => Just(Some(Command::Disarm))
    ];
    let monitors = prop_oneof![3 => Just(None), 1 => (any::<i32>(), any::<i32>()).prop_map(Some)];
    let fault = prop_oneof![30 => Just(None), 1 => (0..7usize).prop_map(|i| Some(Fault::ALL[i]))];
    (command, any::<i32>(), prop_oneof![0..1000u32, any::<u32>()], 0..20u8, 0..40u32, monitors, fault).prop_map(
        |(command, target, ticks_since_host, interlock, missed, monitors, fault)| Inputs {
            command,
            target: Volts(Signal::from_bits(target)),
            ticks_since_host,
            interlock_closed: interlock > 0,
            missed_ticks: missed.saturating_sub(37),
            monitors: monitors
                .map(|(v, current_ua)| Monitors { voltage: Volts(Signal::from_bits(v)), current_ua: current_ua >> 12 }),
            fault,
        },
    )
}

proptest! {
    /// Whatever comes in, in whatever order: a voltage leaves only in `Armed`, never with the interlock open or a fault
    /// reported, and `Armed` is entered only from `Disarmed` by an arm command.
    #[test]
    fn no_order_of_events_lets_a_voltage_out(events in prop::collection::vec(any_inputs(), 1..400)) {
        let mut supervisor = Supervisor::new(config(), None);
        for inputs in events {
            let before = supervisor.state();
            let (decision, drive) = tick(&mut supervisor, inputs);
            let armed = supervisor.state() == State::Armed;
            prop_assert_eq!(drive.enabled(), armed);
            prop_assert_eq!(decision == Decision::Rest, !armed);
            prop_assert!(armed || drive == Drive::SAFE);
            prop_assert!(!(armed && (!inputs.interlock_closed || inputs.fault.is_some())));
            if armed && before != State::Armed {
                prop_assert_eq!((before, inputs.command), (State::Disarmed, Some(Command::Arm)));
            }
            if let State::Faulted(fault) = before {
                let after = supervisor.state();
                let acknowledged = inputs.command == Some(Command::Disarm);
                prop_assert!(after == State::Faulted(fault) || (acknowledged && after == State::Disarmed));
            }
        }
    }
}
