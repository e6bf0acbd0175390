//! An amplifier whose monitors disagree with the output.

use super::*;

/// Adds these readings of the monitors to the inputs.
fn reading(voltage_v: f64, current_ua: i32, inputs: Inputs) -> Inputs {
    Inputs { monitors: Some(Monitors { voltage: volts(voltage_v), current_ua, supply_mv: None }), ..inputs }
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
        ticks(&mut supervisor, 49, reading(299.0, -1999, good()));
    }
    assert_eq!(supervisor.state(), State::Armed, "the amplifier settles after each change");
}

/// A wire that makes contact now and then.
#[test]
fn a_noisy_monitor_that_disagrees_in_more_than_half_of_the_ticks_is_a_fault() {
    for (wrong, right, fault) in [(2, 1, true), (49, 1, true), (26, 25, true), (1, 1, false), (2, 3, false)] {
        let mut supervisor = armed();
        let faulted = (0..100).find_map(|round| {
            ticks(&mut supervisor, wrong, reading(200.0, 0, good()));
            let state = ticks(&mut supervisor, right, reading(300.0, 0, good()));
            (state == State::Faulted(Fault::Monitor)).then_some((round + 1) * (wrong + right))
        });
        assert_eq!(faulted.is_some(), fault, "{wrong} of {}", wrong + right);
        // In each round as many ticks more than that are counted.
        let longest = (51 / wrong.saturating_sub(right).max(1) + 2) * (wrong + right);
        assert!(faulted.is_none_or(|ticks| ticks <= longest), "{wrong} of {}: {faulted:?}", wrong + right);
    }
}

/// Between 0 and 300 V every 200 ms.
#[test]
fn a_monitor_that_is_late_by_more_than_the_amplifier_may_take_to_settle_is_a_fault() {
    for (late, fault) in [(0, false), (40, false), (50, false), (51, true), (60, true)] {
        let mut supervisor = armed();
        let voltage = |tick: usize| if (tick / 200).is_multiple_of(2) { 300.0 } else { 0.0 };
        for now in 1..1000_usize {
            // The reading is that of the output of the tick before.
            let measured = voltage((now - 1).saturating_sub(late));
            supervisor.decide(&reading(measured, 0, good()));
            supervisor.release(&output(voltage(now)));
        }
        let state = if fault { State::Faulted(Fault::Monitor) } else { State::Armed };
        assert_eq!(supervisor.state(), state, "late by {late} ms");
    }
}

#[test]
fn a_disagreement_is_forgotten_within_the_time_that_is_allowed_for_it() {
    let mut supervisor = Supervisor::new(config(), None);
    ticks(&mut supervisor, 5000, reading(500.0, 0, good()));
    ticks(&mut supervisor, 1001, reading(0.0, 0, good()));
    assert_eq!(ticks(&mut supervisor, 1, reading(0.0, 0, disarm())), State::Disarmed);
    assert_eq!(ticks(&mut supervisor, 1000, reading(500.0, 0, good())), State::Disarmed);
    assert_eq!(ticks(&mut supervisor, 1, reading(500.0, 0, good())), State::Faulted(Fault::Monitor));
}

/// The second begins with the tick that disables the output, whatever the monitors read before.
#[test]
fn a_voltage_that_stays_for_more_than_the_discharge_time_is_a_fault() {
    let mut supervisor = armed();
    ticks(&mut supervisor, 49, reading(500.0, 0, good()));
    tick(&mut supervisor, reading(500.0, 0, disarm()));
    for _ in 0..2 {
        assert_eq!(ticks(&mut supervisor, 1000, reading(500.0, 0, good())), State::Disarmed);
        ticks(&mut supervisor, 1000, reading(35.0, 0, good()));
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

#[test]
fn what_disagrees_is_named_and_stays_named_until_it_is_acknowledged() {
    for (voltage_v, current_ua, supply_mv, name) in [
        (200.0, 0, 3300, Some(Mismatch::Limit)),
        (20.0, 0, 3300, Some(Mismatch::Open)),
        (20.0, 2001, 3300, Some(Mismatch::Short)),
        (300.0, 2001, 3300, Some(Mismatch::Leakage)),
        (428.6, 0, 3300, Some(Mismatch::Reference)),
        (300.0, 0, 3600, Some(Mismatch::Reference)),
        (300.0, 0, 3466, Some(Mismatch::Reference)),
        (300.0, 0, 3134, Some(Mismatch::Reference)),
        (300.0, 0, 3465, None),
        (300.0, 0, 3135, None),
    ] {
        let monitors = Some(Monitors { voltage: volts(voltage_v), current_ua, supply_mv: Some(supply_mv) });
        let mut supervisor = armed();
        tick(&mut supervisor, Inputs { monitors, ..good() });
        assert_eq!(supervisor.mismatch(), name, "{voltage_v} V {current_ua} uA {supply_mv} mV");
        ticks(&mut supervisor, 50, Inputs { monitors, ..good() });
        let state = if name.is_some() { State::Faulted(Fault::Monitor) } else { State::Armed };
        assert_eq!(supervisor.state(), state, "{voltage_v} V {current_ua} uA {supply_mv} mV");
        if name.is_some() {
            ticks(&mut supervisor, 1100, reading(400.0, 0, good()));
            assert_eq!(supervisor.mismatch(), name, "the amplifier is off and holds a voltage for too long as well");
            ticks(&mut supervisor, 10, reading(0.0, 0, good()));
            assert_eq!(supervisor.mismatch(), name, "the amplifier is off, and the name stays");
            assert_eq!(ticks(&mut supervisor, 1, reading(0.0, 0, disarm())), State::Disarmed);
            assert_eq!(supervisor.mismatch(), None);
        }
    }
    let mut supervisor = Supervisor::new(config(), None);
    ticks(&mut supervisor, 1001, reading(500.0, 0, good()));
    assert_eq!(supervisor.mismatch(), Some(Mismatch::Held));
}

/// With a supply of 3.6 V for DAC and ADC, 764 V read back as 700 V.
#[test]
fn a_wrong_supply_of_the_converters_is_a_fault_in_every_state_and_nothing_is_armed() {
    let wrong = |inputs| Inputs {
        monitors: Some(Monitors { voltage: volts(0.0), current_ua: 0, supply_mv: Some(3600) }),
        ..inputs
    };
    let mut supervisor = Supervisor::new(config(), None);
    assert_eq!(tick(&mut supervisor, wrong(arm())).1, Drive::SAFE);
    assert_eq!((supervisor.state(), supervisor.refusal()), (State::Disarmed, Some(Refusal::Reference)));
    assert_eq!(ticks(&mut supervisor, 1000, wrong(good())), State::Faulted(Fault::Monitor));
    assert_eq!(supervisor.mismatch(), Some(Mismatch::Reference));
    tick(&mut supervisor, wrong(disarm()));
    assert_eq!((supervisor.state(), supervisor.refusal()), (State::Faulted(Fault::Monitor), Some(Refusal::Reference)));
}

/// Runs an armed supervisor until the fault, with the expected voltage and its reading in each tick; returns what is named.
fn named(driven_at: impl Fn(u32) -> f64, volts_at: impl Fn(u32) -> f64) -> Option<Mismatch> {
    let mut supervisor = armed();
    for now in 0..60 {
        supervisor.release(&output(driven_at(now)));
        supervisor.decide(&reading(volts_at(now), 0, good()));
    }
    assert_eq!(supervisor.state(), State::Faulted(Fault::Monitor));
    supervisor.mismatch()
}

/// The voltage of an amplifier that is too slow moves by 2.2 V or more, a sixteenth of the tolerance, within the second half of 50 ms.
#[test]
fn an_amplifier_that_is_too_slow_is_distinguished_from_one_at_a_limit_or_with_another_scale() {
    let slewed = |from_v: f64, rate_v: f64| move |now: u32| from_v + rate_v * f64::from(now);
    let still = |_| 300.0;
    for rate_v in [0.1, 0.5, 2.0] {
        assert_eq!(named(still, slewed(100.0, rate_v)), Some(Mismatch::Slew), "rising by {rate_v} V in a tick");
        assert_eq!(named(still, slewed(500.0, -rate_v)), Some(Mismatch::Slew), "falling by {rate_v} V in a tick");
    }
    assert_eq!(named(still, slewed(0.0, 0.1)), Some(Mismatch::Slew), "it begins to move");
    assert_eq!(named(still, slewed(100.0, 0.05)), Some(Mismatch::Limit), "1.3 V in 25 ms");
    assert_eq!(named(still, slewed(200.0, -0.5)), Some(Mismatch::Limit), "away from the expected voltage");
    assert_eq!(named(still, slewed(400.0, 0.5)), Some(Mismatch::Reference), "away from the expected voltage");
    // It was on its way to its limit in the first half.
    assert_eq!(named(still, |now| 100.0 + 10.0 * f64::from(now.min(12))), Some(Mismatch::Limit));
    let falling = |now: u32| 300.0 - 0.4 * f64::from(now);
    assert_eq!(named(falling, |now| 1.43 * falling(now)), Some(Mismatch::Reference), "the scale of another amplifier");
    assert_eq!(named(falling, slewed(500.0, -1.0)), Some(Mismatch::Slew), "and a slow one meanwhile");
}

/// The reading after 25 ms is compared with the one after 50 ms.
#[test]
fn a_slow_amplifier_is_recognised_from_an_approach_of_a_sixteenth_of_the_tolerance_on() {
    let step_v = 1.0 / f64::from(1 << 20);
    let rises = |by_v: f64| move |now: u32| if now <= 25 { 100.0 } else { 100.0 + by_v };
    assert_eq!(named(|_| 300.0, rises(35.0 / 16.0)), Some(Mismatch::Limit));
    assert_eq!(named(|_| 300.0, rises(35.0 / 16.0 + step_v)), Some(Mismatch::Slew));
    let earlier = |now: u32| if now < 25 { 100.0 } else { 110.0 };
    assert_eq!(named(|_| 300.0, earlier), Some(Mismatch::Limit), "the last reading of the first half counts");
    // While the expected voltage rises by 1 V, the approach has to be 2 V more.
    let driven = |now: u32| if now <= 25 { 300.0 } else { 301.0 };
    assert_eq!(named(driven, rises(35.0 / 16.0 + 2.0)), Some(Mismatch::Limit));
    assert_eq!(named(driven, rises(35.0 / 16.0 + 2.0 + step_v)), Some(Mismatch::Slew));
}
