//! The time-optimal pre-compensator over limits, moving targets and changes of its configuration, on plain and extended
//! springs. Built with overflow checks: a wrap panics.

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

/// Up and down: at most 1 % beyond, and held there.
fn steps<P: Model>(settings: Settings<P>) {
    let config = settings.check().unwrap();
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
        // Half a code of 0.24 V, of which half comes at once.
        assert!((last - to).abs() < 0.1, "{from} to {to} ends at {last}");
        from = to;
    }
}

#[test]
fn steps_do_not_overshoot_and_stay() {
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

/// What is within reach is there after one tick, whatever the spring has been through.
#[test]
fn a_small_step_takes_one_tick() {
    let relaxation = Relaxation { share: 0.2, time_constant_high_s: None, ..WHOLE.relaxation };
    let leakage = Some(Leakage { share: 0.5, time_constant_s: 1.0 });
    let plain = ExtendedPlant { memory: None, law: None, leakage: None, relaxation };
    let quick =
        Relaxation { share: 0.05, time_constants_s: &[0.1], weights: &[0.95], time_constant_high_s: Some(0.05) };
    // The voltage of the step itself halves the time constant, which is not foreseen.
    for (plant, most) in [
        (plain, 0.001),
        (ExtendedPlant { leakage, ..plain }, 0.001),
        (ExtendedPlant { memory: WHOLE.memory, ..plain }, 0.001),
        (ExtendedPlant { law: WHOLE.law, ..plain }, 0.001),
        (ExtendedPlant { relaxation: quick, ..plain }, 0.25),
    ] {
        let amplifier = Amplifier { dac_bits: 16, ..Amplifier::up_to(1000.0) };
        let settings = Settings { rate_hz: 100.0, amplifier, ..settings(plant, 1000.0) };
        let config = settings.check().unwrap();
        let mut state = State::default();
        // Up, down, and held in between.
        for (target, ticks) in [(250.0, 300), (150.0, 300), (200.0, 300)] {
            (0..ticks).for_each(|_| _ = tick(&config, &mut state, target));
        }
        let applied = tick(&config, &mut state, 240.0).applied.to_f64();
        // The same voltage again: what has come by the end of the tick.
        let hold = Settings { compensation: Compensation::None, ..settings }.check().unwrap();
        hold.adopt(&mut state, Volts::new(applied).unwrap());
        let off = tick(&hold, &mut state, applied).stiffness.to_f64() - 240.0;
        assert!(off.abs() < 40.0 * most, "{plant:?}: {off}");
    }
}

/// A bank without direct part answers a turn only after twice its threshold: that way is crossed at once, and not again
/// for less than a code.
#[test]
fn a_memory_that_does_not_answer_a_turn_is_crossed_once() {
    let memory = Some(Memory { direct: 0.0, thresholds_v: &[20.0], weights: &[1.0] });
    let config = settings(ExtendedPlant { memory, law: None, leakage: None, ..WHOLE }, 700.0).check().unwrap();
    let mut state = State::default();
    let volts: Vec<f64> = (0..12_000).map(|_| tick(&config, &mut state, 200.0).voltage.to_f64()).collect();
    let far = volts.windows(2).filter(|pair| (pair[1] - pair[0]).abs() > 20.0).count();
    // To the end of the range, and back with a jump over the way without answer.
    assert!((1..=2).contains(&far), "{far} jumps");
}

/// A robot's trajectory: the voltage is as smooth as the target.
fn follows<P: Model>(settings: Settings<P>, codes: f64) {
    let config = settings.check().unwrap();
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
fn a_moving_target_is_followed_without_chatter() {
    follows(settings(Plant::PAPER, 1000.0), 1.0);
    follows(settings(Plant { share: 0.3, ..Plant::PAPER }, 1000.0), 1.0);
    // Law and memory have corners; beyond them it is smooth.
    let smooth = ExtendedPlant { memory: None, law: None, ..WHOLE };
    follows(settings(smooth, 1000.0), 1.0);
}

/// At rest between two codes it does not hunt.
#[test]
fn at_rest_it_stays_within_one_code() {
    let config = Settings { rate_hz: 10_000.0, ..settings(Plant::PAPER, 700.0) }.check().unwrap();
    let mut state = State::default();
    for _ in 0..300_000 {
        tick(&config, &mut state, 333.3);
    }
    let codes: Vec<u16> = (0..1_000_000).map(|_| tick(&config, &mut state, 333.3).code.0).collect();
    let (lowest, highest) = (codes.iter().min().unwrap(), codes.iter().max().unwrap());
    assert!(highest - lowest <= 1, "codes {lowest} to {highest}");
}

#[test]
fn it_takes_over_and_hands_over_without_a_bump() {
    let paper = Settings::PAPER.check().unwrap();
    let others = [
        settings(Plant::PAPER, 700.0),
        settings(Plant { share: 0.2, time_constant_s: 3.0 }, 700.0),
        Settings {
            compensation: Compensation::TimeOptimal(Approach { time_constant_s: 0.05 }),
            ..settings(Plant::PAPER, 700.0)
        },
    ];
    for other in others {
        let fast = other.check().unwrap();
        let mut state = State::default();
        let last = (0..700).map(|_| tick(&paper, &mut state, 150.0)).last().unwrap().voltage.to_f64();
        fast.adopt(&mut state, Volts::new(150.0).unwrap());
        let first = tick(&fast, &mut state, 150.0).voltage.to_f64();
        // Half a code: it starts from the voltage that was applied.
        assert!((first - last).abs() < 0.1, "{other:?}: {last} {first}");
        for _ in 0..8000 {
            tick(&fast, &mut state, 150.0);
        }
        assert!((tick(&fast, &mut state, 150.0).stiffness.to_f64() - 150.0).abs() < 0.05);
        let last = tick(&fast, &mut state, 150.0).voltage.to_f64();
        paper.adopt(&mut state, Volts::new(150.0).unwrap());
        assert!((tick(&paper, &mut state, 150.0).voltage.to_f64() - last).abs() < 1e-5);
    }
}

/// A longer approach is slower, and asks for less voltage where the target jumps a little.
#[test]
fn an_approach_is_gentler() {
    let peak = |time_constant_s| {
        let compensation = Compensation::TimeOptimal(Approach { time_constant_s });
        let config = Settings { compensation, ..settings(Plant::PAPER, 700.0) }.check().unwrap();
        let mut state = State::default();
        (0..3000).map(|_| tick(&config, &mut state, 5.0).voltage.to_f64()).fold(0.0, f64::max)
    };
    assert!(peak(0.0) > 54.0 && peak(0.1) < 40.0 && peak(0.5) < 30.0, "{} {} {}", peak(0.0), peak(0.1), peak(0.5));
}

#[test]
fn what_cannot_be_inverted_is_named() {
    let named = |plant: ExtendedPlant<'_>| {
        // The other controllers take it.
        assert!(Settings { compensation: Compensation::None, ..settings(plant, 700.0) }.check().is_ok());
        settings(plant, 700.0).check().unwrap_err().field
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
        assert_eq!(Settings { compensation, ..Settings::PAPER }.check().unwrap_err().field, "approach_s");
    }
}
