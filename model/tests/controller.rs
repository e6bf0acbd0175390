//! Tests of the whole tick: long runs, limits, changes of the configuration. They are built with overflow checks: a
//! wrap panics.

use model::{Amplifier, Compensation, Config, Gains, Input, Limits, Output, Plant, Settings, State, Volts};
use proptest::prelude::*;

fn gains(proportional: f64, integral_per_s: f64) -> Compensation {
    Compensation::ProportionalIntegral(Gains { proportional, integral_per_s })
}

fn run(config: &Config, state: &mut State, target_v: f64, ticks: u32) -> Output {
    let input = Input { target: Volts::new(target_v).unwrap(), ..Input::default() };
    let mut output = config.tick(state, input);
    for _ in 1..ticks {
        output = config.tick(state, input);
    }
    output
}

/// The amplifier is off at 0 V: what it put out before must not be where its slew starts from.
#[test]
fn after_a_rest_the_voltage_starts_from_zero() {
    let amplifier = Amplifier { slew_v_per_s: Some(200.0), ..Amplifier::PAPER };
    let config = Settings { amplifier, ..Settings::PAPER }.validate().unwrap().quantize();
    let mut state = State::default();
    assert!(run(&config, &mut state, 300.0, 5000).voltage.to_f64() > 200.0);
    let rest = config.rest(&mut state, None);
    assert_eq!((rest.voltage, rest.code.0, rest.applied), (Volts::ZERO, 0, Volts::ZERO));
    config.bumpless_transfer(&mut state, Volts::ZERO);
    let first = run(&config, &mut state, 300.0, 1).voltage.to_f64();
    assert!((0.0..0.201).contains(&first), "{first} V in the first tick, at 0.2 V per tick");
}

/// Ten million ticks at rest on a voltage between two codes.
#[test]
fn the_code_stays_within_one_step_for_ten_million_ticks_at_rest() {
    let settings = Settings { rate_hz: 10_000.0, ..Settings::PAPER };
    let config = settings.validate().unwrap().quantize();
    let mut state = State::default();
    let target = 333.3;
    run(&config, &mut state, target, 1_000_000);
    let input = Input { target: Volts::new(target).unwrap(), ..Input::default() };
    let (mut lowest, mut highest, mut sum) = (u16::MAX, 0, 0.0);
    for _ in 0..10_000_000 {
        let output = config.tick(&mut state, input);
        (lowest, highest) = (lowest.min(output.code.0), highest.max(output.code.0));
        let off = output.stiffness.to_f64() - target;
        assert!(off.abs() < 0.03, "{off}");
        sum += off;
        assert_eq!(output.limits, Limits::NONE);
    }
    assert!(highest - lowest <= 1, "codes {lowest} to {highest}");
    // The loop settles with the voltage before rounding: the feedthrough of half a code may remain.
    let allowed = settings.plant.share * 0.5 * settings.amplifier.volts_per_code();
    assert!((sum / 1e7).abs() < allowed, "mean error {} of {allowed}", sum / 1e7);
}

/// After a minute at a limit, the response to a lower target is that of a loop that was never limited. A wound-up
/// integrator would keep the voltage at the limit for a while.
#[test]
fn the_integrator_does_not_wind_up() {
    for slew_v_per_s in [None, Some(200.0)] {
        let answer = |max_v, first| {
            let amplifier = Amplifier { max_v, slew_v_per_s, ..Amplifier::PAPER };
            let config = Settings { amplifier, ..Settings::PAPER }.validate().unwrap().quantize();
            let mut state = State::default();
            let held = run(&config, &mut state, first, 60_000);
            assert!((held.stiffness.to_f64() - 500.0).abs() < 0.2);
            assert_eq!(held.limits.intersects(Limits::TARGET), first > max_v, "a target beyond the range is reported");
            [100, 500, 1000, 3500].map(|ticks| run(&config, &mut state, 300.0, ticks).stiffness.to_f64())
        };
        let (limited, free) = (answer(500.0, 700.0), answer(700.0, 500.0));
        for (limited, free) in limited.into_iter().zip(free) {
            assert!((limited - free).abs() < 0.3, "{limited} {free}");
        }
    }
}

#[test]
fn a_transfer_to_new_gains_limits_plant_or_rate_is_bumpless() {
    let settings = Settings::PAPER;
    let before = settings.validate().unwrap().quantize();
    let others = [
        Settings { compensation: gains(12.0, 0.3), ..settings },
        Settings { compensation: gains(0.5, 5.0), ..settings },
        Settings { plant: Plant { share: 0.3, time_constant_s: 2.0 }, ..settings },
        Settings { amplifier: Amplifier { max_v: 600.0, ..settings.amplifier }, ..settings },
        Settings { amplifier: Amplifier { min_v: 100.0, ..settings.amplifier }, ..settings },
        Settings { rate_hz: 5000.0, ..settings },
    ];
    for other in others {
        let after = other.validate().unwrap().quantize();
        let mut state = State::default();
        // In the middle of a transient, where the error is large.
        let last = run(&before, &mut state, 150.0, 700);
        let mut without_transfer = state;
        after.bumpless_transfer(&mut state, Volts::new(150.0).unwrap());
        let next = run(&after, &mut state, 150.0, 1);
        let bump = (next.voltage.to_f64() - last.voltage.to_f64()).abs();
        assert!(bump < 1e-5, "{other:?}: {bump} V");
        if other.compensation != settings.compensation {
            let next = run(&after, &mut without_transfer, 150.0, 1);
            assert!(
                (next.voltage.to_f64() - last.voltage.to_f64()).abs() > 1.0,
                "this change would not move the voltage without a transfer either"
            );
        }
    }
}

#[test]
fn a_new_range_below_the_voltage_takes_effect_in_the_next_tick() {
    let wide = Settings::PAPER.validate().unwrap().quantize();
    let amplifier = Amplifier { max_v: 250.0, slew_v_per_s: Some(10.0), ..Amplifier::PAPER };
    let narrow = Settings { amplifier, ..Settings::PAPER }.validate().unwrap().quantize();
    let mut state = State::default();
    run(&wide, &mut state, 400.0, 10_000);
    narrow.bumpless_transfer(&mut state, Volts::new(400.0).unwrap());
    let output = run(&narrow, &mut state, 400.0, 1);
    assert!(output.applied.to_f64() <= 250.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Random settings, targets and changes of the settings.
    #[test]
    fn the_output_stays_in_range(
        rate in 2.0..=4.0f64,
        share in 0.0..=0.9f64,
        time_constant in -2.0..4.0f64,
        all_gains in prop::collection::vec((-3.0..2.0f64, -4.0..5.0f64), 2..5),
        (full_scale_v, part, dac_bits) in (50.0..=1000.0f64, 0.3..=1.0f64, 8u32..=16),
        slew in prop::option::of(0.0..9.0f64),
        targets in prop::collection::vec(-2000.0..2000.0f64, 1..30),
    ) {
        let mut state = State::default();
        for (proportional, integral) in all_gains {
            let settings = Settings {
                rate_hz: 10f64.powf(rate),
                plant: Plant { share, time_constant_s: 10f64.powf(time_constant) },
                compensation: gains(10f64.powf(proportional), 10f64.powf(integral)),
                amplifier: Amplifier {
                    max_v: (part * full_scale_v).max(10.0),
                    slew_v_per_s: slew.map(|decades| 10f64.powf(decades)),
                    dac_bits,
                    ..Amplifier::up_to(full_scale_v)
                },
                feedback: None,
            };
            let Ok(valid) = settings.validate() else { continue };
    let config = valid.quantize();
            let (lowest, highest) = config.range();
            config.bumpless_transfer(&mut state, Volts::new(targets[0]).unwrap());
            for &target in &targets {
                let output = run(&config, &mut state, target, 50);
                prop_assert!(output.applied >= lowest && output.applied <= highest);
                prop_assert!(output.voltage >= lowest && output.voltage <= highest);
                let (stiffness, most) = (output.stiffness.to_f64(), highest.to_f64());
                prop_assert!((-1e-5..most + 1e-5).contains(&stiffness), "{stiffness}");
            }
        }
    }
}
