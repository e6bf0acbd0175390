//! Tests of what a sensor changes, and of changes of the configuration that move neither voltage nor estimate.

use super::*;

/// The plain spring with a sensor.
const WITH_SENSOR: Settings = Settings { feedback: Some(Feedback::TYPICAL), ..Settings::PAPER };

/// Runs `config` for 2 s towards `target_v` with a sensor that reads 20 V above the model, 0.1 V of noise included.
fn corrected(config: &Config, target_v: f64) -> State {
    let (mut state, mut model) = (State::default(), Signal::ZERO);
    for number in 0..2000 {
        let stiffness = ScaledStiffness(model + Signal::from_num(20.0 + 0.1 * f64::from(number % 3 - 1)));
        let measured = Some(Reading { stiffness, age: 0 });
        model = config.tick(&mut state, Input { measured, ..input(target_v) }).stiffness.0 - state.correction().0;
    }
    state
}

#[test]
fn at_rest_the_sensor_corrects_the_estimate_too() {
    let config = quantized(&WITH_SENSOR);
    let mut state = corrected(&config, 300.0);
    assert!((state.correction().to_f64() - 20.0).abs() < 0.5, "{:?}", state.correction());
    let model = config.estimator.estimate(&state.estimator, Volts::ZERO);
    let output = config.rest(&mut state, None);
    assert_eq!(output.stiffness.0 - model.0, state.correction().0);
    assert_eq!(output.sensor, Some(Sensor::Trusted));
}

#[test]
fn a_sensor_is_trusted_once_it_has_been_read() {
    assert!(!State::<estimator::State>::default().feedback.is_trusted());
    assert!(corrected(&quantized(&WITH_SENSOR), 300.0).feedback.is_trusted());
}

/// 20 000 V/s are 20 V in a tick at 1 kHz; 50 V of stiffness ask for 550 V.
#[test]
fn with_a_trusted_sensor_the_robust_voltage_moves_towards_a_target_by_20_v_in_a_tick() {
    let config = quantized(&Settings { compensation: Compensation::Robust(Margin::TYPICAL), ..WITH_SENSOR });
    let running = corrected(&config, 100.0);
    let last = running.amplifier.voltage().to_f64();
    for (target_v, expected) in [(50.0, -20.0), (150.0, 20.0)] {
        let moved = config.tick(&mut running.clone(), input(target_v)).voltage.to_f64() - last;
        assert!((moved - expected).abs() < 1e-3, "{moved} V to {target_v} V");
    }
}

#[test]
fn a_spring_that_takes_over_moves_neither_the_voltage_nor_the_estimate() {
    let before = quantized(&WITH_SENSOR);
    let after = quantized(&Settings { plant: Plant { share: 0.12, time_constant_s: 4.0 }, ..WITH_SENSOR });
    let mut state = corrected(&before, 300.0);
    let (mut unchanged, last) = (state, state.amplifier.voltage().to_f64());
    let expected = before.tick(&mut unchanged, input(300.0)).stiffness;
    let stiffness = before.present(&state);
    after.take_over(&mut state, Volts::new(300.0).unwrap(), stiffness);
    assert_eq!(after.present(&state), stiffness);
    let output = after.tick(&mut state, input(300.0));
    assert!((output.voltage.to_f64() - last).abs() < 1e-5, "{} V after {last} V", output.voltage.to_f64());
    // The voltage that stays differs by what one more tick of the model before would have moved it.
    let moved = output.stiffness.to_f64() - expected.to_f64();
    assert!(moved.abs() < 0.05, "{moved} V");
}

#[test]
fn a_transfer_from_one_pre_compensator_to_another_does_not_move_the_voltage() {
    let all = [
        Compensation::ProportionalIntegral(Gains::PAPER),
        Compensation::TimeOptimal(Approach::DEAD_BEAT),
        Compensation::Robust(Margin::TYPICAL),
    ];
    for (first, second) in all.iter().flat_map(|first| all.iter().map(move |second| (*first, *second))) {
        let [before, after] =
            [first, second].map(|compensation| quantized(&Settings { compensation, ..Settings::PAPER }));
        let mut state = State::default();
        let last = (0..40).map(|_| before.tick(&mut state, input(50.0))).last().unwrap();
        after.bumpless_transfer(&mut state, Volts::new(50.0).unwrap());
        let moved = after.tick(&mut state, input(50.0)).voltage.to_f64() - last.voltage.to_f64();
        // A code is 0.17 V; no limit acts.
        assert!(moved.abs() < 0.5, "{first:?} to {second:?}: {moved} V");
    }
}
