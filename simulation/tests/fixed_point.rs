//! Compares the fixed-point tick with a double-precision loop of the same rate over random rates, springs, gains,
//! amplifiers and stairs: stiffness, and voltage before rounding, agree within 0.01 V at every tick.
//!
//! The double-precision loop follows the DAC code of the tick, after a check that this code is the nearest: a voltage
//! half-way between two codes may be rounded either way.

use std::cell::Cell;

use model::{Amplifier, Compensation, Gains, Input, Plant, Settings, Volts};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use simulation::sampled::{Controller, SampledLoop};

const ALLOWED_V: f64 = 0.01;

/// A loop, and levels of the range (0 to 1), each with its number of ticks.
#[derive(Clone, Debug)]
struct Case {
    settings: Settings,
    stair: Vec<(f64, u32)>,
}

prop_compose! {
    fn amplifier()(
        full_scale_v in 50.0..=1000.0f64,
        (low, high) in (0.0..0.4f64, 0.5..=1.0f64),
        starts_at_zero: bool,
        slew in prop::option::of(0.0..=9.0f64),
        dac_bits in 8u32..=16,
    ) -> Amplifier {
        let (min_v, max_v) = (if starts_at_zero { 0.0 } else { low * (full_scale_v - 25.0) }, high * full_scale_v);
        let slew_v_per_s = slew.map(|decades| 10f64.powf(decades));
        Amplifier { full_scale_v, min_v, max_v: max_v.max(min_v + 10.0), slew_v_per_s, dac_bits }
    }
}

prop_compose! {
    fn case()(
        rate in 2.0..=4.0f64,
        share in 0.0..=0.9f64,
        time_constant in -3.7..=4.0f64,
        proportional in -3.0..=2.0f64,
        reset_ticks in 1.0..8.0f64,
        amplifier in amplifier(),
        stair in prop::collection::vec((-0.1..1.1f64, 1u32..4000), 1..8),
    ) -> Case {
        let integral = proportional + rate - reset_ticks;
        let gains = Gains { proportional: 10f64.powf(proportional), integral_per_s: 10f64.powf(integral) };
        let plant = Plant { share, time_constant_s: 10f64.powf(time_constant) };
        let compensation = Compensation::ProportionalIntegral(gains);
        Case { settings: Settings { rate_hz: 10f64.powf(rate), plant, compensation, amplifier, feedback: None }, stair }
    }
}

/// Largest differences of stiffness and voltage, in V; `None` if the settings are rejected.
fn disagreement(case: &Case) -> Option<(f64, f64)> {
    let Settings { rate_hz, plant, compensation, amplifier, .. } = case.settings;
    let config = case.settings.validate().ok()?.quantize();
    let Compensation::ProportionalIntegral(gains) = compensation else { return None };
    let (lowest, highest) = config.range();
    let range_v = (lowest.to_f64(), highest.to_f64());
    let double = SampledLoop {
        sample_s: 1.0 / rate_hz,
        spring: plant.into(),
        controller: Controller::ProportionalIntegral(gains.proportional, gains.integral_per_s),
        range_v,
        slew_v_per_s: amplifier.slew_v_per_s.unwrap_or(f64::INFINITY),
    };
    let (mut fixed, mut state) = (model::State::default(), double.at_rest());
    let (mut stiffness_off, mut voltage_off) = (0.0f64, 0.0f64);
    for &(level, ticks) in &case.stair {
        let target = Volts::new(range_v.0 + level * (range_v.1 - range_v.0)).ok()?;
        for _ in 0..ticks {
            let output = config.tick(&mut fixed, Input { target, ..Input::default() });
            let voltage = double.drive(&mut state, target.to_f64());
            let applied = output.applied.to_f64();
            let rounding = (applied - voltage).abs() / amplifier.volts_per_code();
            assert!(rounding < 0.503 + ALLOWED_V / amplifier.volts_per_code(), "not the nearest code: {rounding}");
            let stiffness = double.apply(&mut state, applied);
            voltage_off = voltage_off.max((output.voltage.to_f64() - voltage).abs());
            stiffness_off = stiffness_off.max((output.stiffness.to_f64() - stiffness).abs());
        }
    }
    Some((stiffness_off, voltage_off))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn fixed_point_agrees_with_double_precision(case in case()) {
        if let Some((stiffness, voltage)) = disagreement(&case) {
            prop_assert!(stiffness < ALLOWED_V, "stiffness off by {stiffness} V");
            prop_assert!(voltage < ALLOWED_V, "voltage off by {voltage} V");
        }
    }
}

/// Prints the worst of 1000 loops, the same in every run: `cargo test -p simulation --test fixed_point -- --nocapture`.
#[test]
fn worst_case_of_a_thousand_loops() {
    let mut runner = TestRunner::deterministic();
    let worst = Cell::new((0, 0.0f64, 0.0f64));
    while worst.get().0 < 1000 {
        let case = case().new_tree(&mut runner).expect("no filters").current();
        if let Some((stiffness, voltage)) = disagreement(&case) {
            let (count, worst_stiffness, worst_voltage) = worst.get();
            worst.set((count + 1, worst_stiffness.max(stiffness), worst_voltage.max(voltage)));
        }
    }
    let (count, stiffness, voltage) = worst.get();
    println!("worst of {count} loops: stiffness {:.3} mV, voltage {:.3} mV", stiffness * 1e3, voltage * 1e3);
    assert!(stiffness < ALLOWED_V && voltage < ALLOWED_V);
    // Exact agreement would mean that both run the same code.
    assert!(stiffness > 0.0 && voltage > 0.0);
}
