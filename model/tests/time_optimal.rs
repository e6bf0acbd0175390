//! Tests of the time-optimal pre-compensator: limits, moving targets and changes of the configuration, with plain and
//! extended springs. They are built with overflow checks: a wrap panics.

#[path = "time_optimal/range.rs"]
mod range;
mod springs;

use model::estimator::{Estimator, Model};
use model::extended::{ExtendedPlant, Law, Leakage, Memory, Relaxation};
use model::{Amplifier, Approach, Compensation, Config, Input, Output, Plant, Settings, State, Volts};
use springs::WHOLE;

const FAST: Compensation = Compensation::TimeOptimal(Approach::DEAD_BEAT);

fn settings<P: Model>(plant: P, limit_v: f64) -> Settings<P> {
    Settings { rate_hz: 1000.0, plant, compensation: FAST, amplifier: Amplifier::up_to(limit_v), feedback: None }
}

fn tick<E: Estimator>(config: &Config<E>, state: &mut State<E::State>, target_v: f64) -> Output {
    config.tick(state, Input { target: Volts::new(target_v).unwrap(), ..Input::default() })
}

/// Asserts that steps up and down overshoot by at most 1 % and settle at the target.
fn steps<P: Model>(settings: Settings<P>) {
    let config = settings.validate().unwrap().quantize();
    let mut state = State::default();
    let mut from = 0.0;
    for to in [100.0, 300.0, 400.0, 350.0, 250.0, 300.0] {
        let mut farthest = 0.0f64;
        let mut last = 0.0;
        for _ in 0..12_000 {
            last = tick(&config, &mut state, to).stiffness.to_f64();
            farthest = farthest.max((last - from) / (to - from));
        }
        assert!(farthest <= 1.01, "{from} to {to}: {farthest}");
        // Half a code of 0.24 V, of which half is feedthrough.
        assert!((last - to).abs() < 0.1, "{from} to {to} ends at {last}");
        from = to;
    }
}

#[test]
fn steps_overshoot_by_at_most_1_percent_and_settle() {
    for limit_v in [700.0, 1000.0] {
        steps(settings(Plant::PAPER, limit_v));
        steps(settings(Plant { share: 0.0, ..Plant::PAPER }, limit_v));
        steps(Settings { rate_hz: 10_000.0, ..settings(Plant { share: 0.5, ..Plant::PAPER }, limit_v) });
    }
    steps(settings(WHOLE, 1000.0));
    for slew in [200.0, 500.0, 2000.0] {
        let amplifier = Amplifier { slew_v_per_s: Some(slew), ..Amplifier::up_to(1000.0) };
        steps(Settings { amplifier, ..settings(Plant::PAPER, 1000.0) });
        steps(Settings { amplifier, ..settings(Plant { share: 0.02, ..Plant::PAPER }, 1000.0) });
        steps(Settings { amplifier, ..settings(WHOLE, 1000.0) });
    }
}

/// A target that the range allows to reach within one tick, whatever the history of the spring.
#[test]
fn a_reachable_step_takes_one_tick() {
    let relaxation = Relaxation { share: 0.2, time_constant_high_s: None, ..WHOLE.relaxation };
    let leakage = Some(Leakage { share: 0.5, time_constant_s: 1.0 });
    let plain = ExtendedPlant { memory: None, law: None, leakage: None, relaxation };
    let quick =
        Relaxation { share: 0.05, time_constants_s: &[0.1], weights: &[0.95], time_constant_high_s: Some(0.05) };
    // The voltage of the step itself halves the time constant, which the inverse does not include.
    for (plant, most) in [
        (plain, 0.001),
        (ExtendedPlant { leakage, ..plain }, 0.001),
        (ExtendedPlant { memory: WHOLE.memory, ..plain }, 0.001),
        (ExtendedPlant { law: WHOLE.law, ..plain }, 0.001),
        (ExtendedPlant { relaxation: quick, ..plain }, 0.25),
    ] {
        let amplifier = Amplifier { dac_bits: 16, ..Amplifier::up_to(1000.0) };
        let settings = Settings { rate_hz: 100.0, amplifier, ..settings(plant, 1000.0) };
        let config = settings.validate().unwrap().quantize();
        let mut state = State::default();
        // Up, down, and in between: the plays are in the middle of a loop.
        for (target, ticks) in [(250.0, 300), (150.0, 300), (200.0, 300)] {
            (0..ticks).for_each(|_| _ = tick(&config, &mut state, target));
        }
        let applied = tick(&config, &mut state, 240.0).applied.to_f64();
        // With the same voltage, the next tick begins with the stiffness at the end of this one.
        let hold = Settings { compensation: Compensation::None, ..settings }.validate().unwrap().quantize();
        hold.bumpless_transfer(&mut state, Volts::new(applied).unwrap());
        let off = tick(&hold, &mut state, applied).stiffness.to_f64() - 240.0;
        assert!(off.abs() < 40.0 * most, "{plant:?}: {off}");
    }
}

/// A bank without direct part does not respond after a turn until the voltage has changed by twice the threshold: the
/// voltage jumps over this gap, and not again for less than a code.
#[test]
fn a_gap_without_response_after_a_turn_is_crossed_once() {
    let memory = Some(Memory { direct: 0.0, thresholds_v: &[20.0], weights: &[1.0] });
    let config =
        settings(ExtendedPlant { memory, law: None, leakage: None, ..WHOLE }, 700.0).validate().unwrap().quantize();
    let mut state = State::default();
    let volts: Vec<f64> = (0..12_000).map(|_| tick(&config, &mut state, 200.0).voltage.to_f64()).collect();
    let far = volts.windows(2).filter(|pair| (pair[1] - pair[0]).abs() > 20.0).count();
    // To the end of the range, and back with a jump over the gap.
    assert!((1..=2).contains(&far), "{far} jumps");
}

/// Asserts that the voltage is as smooth as a sinusoidal target.
fn follows<P: Model>(settings: Settings<P>, codes: f64) {
    let config = settings.validate().unwrap().quantize();
    let code_v = settings.amplifier.volts_per_code();
    let mut state = State::default();
    let target = |tick: i32| 200.0 - 15.0 * (f64::from(tick) * 1e-3 * 2.0).cos();
    for tick_number in -20_000..0 {
        tick(&config, &mut state, target(0).min(target(0) * f64::from(20_000 + tick_number) / 10_000.0));
    }
    let mut volts = Vec::new();
    for tick_number in 0..8000 {
        let output = tick(&config, &mut state, target(tick_number));
        let off = output.stiffness.to_f64() - target(tick_number);
        assert!(off.abs() < 0.5, "{tick_number}: {off}");
        volts.push(output.voltage.to_f64());
    }
    for (tick_number, three) in volts.windows(3).enumerate() {
        let bend = three[2] - 2.0 * three[1] + three[0];
        assert!(bend.abs() < codes * code_v, "{tick_number}: {bend} V");
    }
}

#[test]
fn a_moving_target_is_followed_with_a_smooth_voltage() {
    follows(settings(Plant::PAPER, 1000.0), 1.0);
    follows(settings(Plant { share: 0.3, ..Plant::PAPER }, 1000.0), 1.0);
    // Law and memory have corners.
    let smooth = ExtendedPlant { memory: None, law: None, ..WHOLE };
    follows(settings(smooth, 1000.0), 1.0);
}

/// At rest on a voltage between two codes.
#[test]
fn the_code_stays_within_one_step_at_rest() {
    let config = Settings { rate_hz: 10_000.0, ..settings(Plant::PAPER, 700.0) }.validate().unwrap().quantize();
    let mut state = State::default();
    for _ in 0..300_000 {
        tick(&config, &mut state, 333.3);
    }
    let codes: Vec<u16> = (0..1_000_000).map(|_| tick(&config, &mut state, 333.3).code.0).collect();
    let (lowest, highest) = (codes.iter().min().unwrap(), codes.iter().max().unwrap());
    assert!(highest - lowest <= 1, "codes {lowest} to {highest}");
}

#[test]
fn transfers_from_and_to_the_proportional_integral_controller_are_bumpless() {
    let paper = Settings::PAPER.validate().unwrap().quantize();
    let others = [
        settings(Plant::PAPER, 700.0),
        settings(Plant { share: 0.2, time_constant_s: 3.0 }, 700.0),
        Settings {
            compensation: Compensation::TimeOptimal(Approach { time_constant_s: 0.05 }),
            ..settings(Plant::PAPER, 700.0)
        },
    ];
    for other in others {
        let fast = other.validate().unwrap().quantize();
        let mut state = State::default();
        let last = (0..700).map(|_| tick(&paper, &mut state, 150.0)).last().unwrap().voltage.to_f64();
        fast.bumpless_transfer(&mut state, Volts::new(150.0).unwrap());
        let first = tick(&fast, &mut state, 150.0).voltage.to_f64();
        // Half a code: the law starts from the applied voltage, which is rounded.
        assert!((first - last).abs() < 0.1, "{other:?}: {last} {first}");
        for _ in 0..8000 {
            tick(&fast, &mut state, 150.0);
        }
        assert!((tick(&fast, &mut state, 150.0).stiffness.to_f64() - 150.0).abs() < 0.05);
        let last = tick(&fast, &mut state, 150.0).voltage.to_f64();
        paper.bumpless_transfer(&mut state, Volts::new(150.0).unwrap());
        assert!((tick(&paper, &mut state, 150.0).voltage.to_f64() - last).abs() < 1e-5);
    }
}

/// A longer approach needs less voltage for a small step.
#[test]
fn a_longer_approach_lowers_the_peak_voltage() {
    let peak = |time_constant_s| {
        let compensation = Compensation::TimeOptimal(Approach { time_constant_s });
        let config = Settings { compensation, ..settings(Plant::PAPER, 700.0) }.validate().unwrap().quantize();
        let mut state = State::default();
        (0..3000).map(|_| tick(&config, &mut state, 5.0).voltage.to_f64()).fold(0.0, f64::max)
    };
    assert!(peak(0.0) > 54.0 && peak(0.1) < 40.0 && peak(0.5) < 30.0, "{} {} {}", peak(0.0), peak(0.1), peak(0.5));
}

#[test]
fn a_spring_without_inverse_is_rejected_by_name() {
    let named = |plant: ExtendedPlant<'_>| {
        // Without the inverse it is accepted.
        assert!(Settings { compensation: Compensation::None, ..settings(plant, 700.0) }.validate().is_ok());
        settings(plant, 700.0).validate().unwrap_err().field
    };
    let law = Law { voltage_v: &[0.0, 100.0, 200.0], stiffness: &[0.0, 100.0, 90.0] };
    assert_eq!(named(ExtendedPlant { law: Some(law), ..WHOLE }), "law.stiffness");
    let memory = Memory { direct: 0.5, thresholds_v: &[10.0], weights: &[-0.6] };
    assert_eq!(named(ExtendedPlant { memory: Some(memory), ..WHOLE }), "memory.direct");
    let leakage = Leakage { share: 1.0, time_constant_s: 40.0 };
    assert_eq!(named(ExtendedPlant { leakage: Some(leakage), ..WHOLE }), "leakage.share");
    for weights in [[1.2, -0.3], [0.0, 0.0]] {
        let relaxation = Relaxation { share: 0.0, weights: &weights, ..WHOLE.relaxation };
        assert_eq!(named(ExtendedPlant { relaxation, ..WHOLE }), "relaxation.weights");
    }
    for time_constant_s in [-1.0, 1.5, f64::NAN] {
        let compensation = Compensation::TimeOptimal(Approach { time_constant_s });
        assert_eq!(Settings { compensation, ..Settings::PAPER }.validate().unwrap_err().field, "approach_s");
    }
}
