//! The extended spring under the whole tick, over all that is accepted. Built with overflow checks: a wrap panics.

mod springs;

use model::estimator::{Estimator, Model};
use model::extended::{self, ExtendedPlant, Law, Leakage, Memory, Relaxation};
use model::{Amplifier, Compensation, Config, Gains, Input, Limits, Plant, SampleTime, Settings, State, Volts};
use proptest::prelude::*;
use springs::WHOLE;

const PLAIN: ExtendedPlant<'_> = ExtendedPlant {
    memory: None,
    law: None,
    leakage: None,
    relaxation: Relaxation {
        share: Plant::PAPER.share,
        time_constants_s: &[Plant::PAPER.time_constant_s],
        weights: &[],
        time_constant_high_s: None,
    },
};

type Running = State<extended::State>;

fn settings<P: Model>(plant: P) -> Settings<P> {
    let Settings { rate_hz, compensation, amplifier, feedback, .. } = Settings::PAPER;
    Settings { rate_hz, plant, compensation, amplifier, feedback }
}

fn gains(proportional: f64, integral_per_s: f64) -> Compensation {
    Compensation::ProportionalIntegral(Gains { proportional, integral_per_s })
}

fn run(config: &Config<extended::Config>, state: &mut Running, target_v: f64, ticks: u32) -> model::Output {
    let input = Input { target: Volts::new(target_v).unwrap(), ..Input::default() };
    let mut output = config.tick(state, input);
    for _ in 1..ticks {
        output = config.tick(state, input);
    }
    output
}

/// What a target may be is the amplifier's range: a spring that holds less in the end is led to the end of the range, which
/// the limit tells. One that would hold more is not asked for it.
#[test]
fn a_target_that_the_spring_does_not_hold_ends_at_the_limit() {
    for (leak, gain, target_v, ends_v) in [(0.3, 0.9, 650.0, 490.0), (0.0, 1.2, 800.0, 700.0)] {
        let leakage = Some(Leakage { share: leak, time_constant_s: 20.0 });
        let relaxation = Relaxation { weights: &[gain], share: 0.1, ..PLAIN.relaxation };
        let plant = ExtendedPlant { leakage, relaxation, ..PLAIN };
        let (config, mut state) = (settings(plant).check().unwrap(), Running::default());
        let output = run(&config, &mut state, target_v, 300_000);
        assert!((output.stiffness.to_f64() - ends_v).abs() < 0.5, "{output:?}");
        let (beyond, moved) = (leak > 0.0, gain > 1.0);
        assert_eq!((output.limits.any_of(Limits::UPPER), output.limits.any_of(Limits::TARGET)), (beyond, moved));
    }
}

/// A plain spring, run as an extended one, does what the plain tick does.
#[test]
fn nothing_extended_is_the_plain_spring() {
    let (plain, extended) = (Settings::PAPER.check().unwrap(), settings(PLAIN).check().unwrap());
    assert_eq!(PLAIN.plain(), Some(Plant::PAPER));
    assert_eq!(WHOLE.plain(), None);
    let (mut state, mut other) = (State::default(), Running::default());
    for target_v in [100.0, 500.0, 333.3, 0.0] {
        for _ in 0..5000 {
            let input = Input { target: Volts::new(target_v).unwrap(), ..Input::default() };
            let (one, two) = (plain.tick(&mut state, input), extended.tick(&mut other, input));
            let off = (one.stiffness.to_f64() - two.stiffness.to_f64()).abs();
            // One code of 0.17 V, where both are half-way between two.
            assert!(off < 0.02 && one.code.0.abs_diff(two.code.0) <= 1, "{off} V: {one:?} {two:?}");
        }
    }
}

/// The loop takes the spring's curve for straight; in a few ticks it is where the exact solution `u + Kp y(u) = ...` is.
#[test]
fn the_voltage_settles_on_the_curve_within_a_few_ticks() {
    // No integral action: nothing else moves so soon.
    let compensation = gains(4.0, 0.0);
    // A law four times as steep further up.
    let law = Law { voltage_v: &[0.0, 200.0, 400.0], stiffness: &[0.0, 100.0, 500.0] };
    let relaxation = Relaxation { time_constants_s: &[5000.0], ..PLAIN.relaxation };
    let plant = ExtendedPlant { law: Some(law), relaxation, ..PLAIN };
    let amplifier = Amplifier { dac_bits: 16, ..Amplifier::PAPER };
    let config = Settings { compensation, amplifier, ..settings(plant) }.check().unwrap();
    let mut state = Running::default();
    // On the flat part u (1 + 4 / 11 / 2) = 4 * 40.
    let exact = 160.0 / (1.0 + 2.0 / 11.0);
    let steepest: f64 = 4.0 * 2.0 / 11.0;
    let shrinks = (steepest - 2.0 / 11.0) / (1.0 + steepest);
    let mut left = exact;
    for tick in 0..12 {
        let voltage = run(&config, &mut state, 40.0, 1).voltage.to_f64();
        left *= shrinks;
        assert!((exact - voltage - left).abs() < 0.02, "tick {tick}: {voltage}, {exact} - {left}");
    }
}

/// Held at a limit for a minute, then asked for less: no later than a loop that was never limited.
#[test]
fn the_integrator_does_not_wind_up() {
    let answer = |max_v, first| {
        let amplifier = Amplifier { max_v, ..Amplifier::PAPER };
        let config = Settings { amplifier, ..settings(WHOLE) }.check().unwrap();
        let mut state = Running::default();
        let held = run(&config, &mut state, first, 60_000);
        assert_eq!(held.limits.any_of(Limits::UPPER), max_v < 700.0, "{held:?}");
        (
            held.stiffness.to_f64(),
            [100, 500, 1000, 3500].map(|ticks| run(&config, &mut state, 200.0, ticks).stiffness.to_f64()),
        )
    };
    // What the limited loop reaches is asked of the free one.
    let (reached, limited) = answer(400.0, 395.0);
    let (_, free) = answer(700.0, reached);
    for (limited, free) in limited.into_iter().zip(free) {
        assert!((limited - free).abs() < 0.5, "{limited} {free}");
    }
}

#[test]
fn new_gains_and_springs_come_without_a_bump() {
    let before = settings(WHOLE).check().unwrap();
    let slower = Relaxation { time_constants_s: &[7.0, 70.0], ..WHOLE.relaxation };
    for other in [
        Settings { compensation: gains(12.0, 0.3), ..settings(WHOLE) },
        settings(ExtendedPlant { leakage: None, relaxation: slower, ..WHOLE }),
        Settings { rate_hz: 5000.0, ..settings(WHOLE) },
    ] {
        let after = other.check().unwrap();
        let mut state = Running::default();
        let last = run(&before, &mut state, 150.0, 700);
        after.adopt(&mut state, Volts::new(150.0).unwrap());
        let next = run(&after, &mut state, 150.0, 1);
        let bump = (next.voltage.to_f64() - last.voltage.to_f64()).abs();
        assert!(bump < 1e-4, "{other:?}: {bump} V");
    }
}

/// At rest at 10 kHz: no drift, no hunting over more than one code.
#[test]
fn two_million_ticks_stay_within_one_code() {
    let plant = ExtendedPlant { leakage: None, ..WHOLE };
    let config = Settings { rate_hz: 10_000.0, ..settings(plant) }.check().unwrap();
    let mut state = Running::default();
    run(&config, &mut state, 222.2, 3_000_000);
    let (mut lowest, mut highest) = (u16::MAX, 0);
    for _ in 0..2_000_000 {
        let output = run(&config, &mut state, 222.2, 1);
        (lowest, highest) = (lowest.min(output.code.0), highest.max(output.code.0));
        assert!((output.stiffness.to_f64() - 222.2).abs() < 0.1, "{output:?}");
    }
    assert!(highest - lowest <= 1, "codes {lowest} to {highest}");
}

#[derive(Clone, Debug)]
struct Numbers {
    direct: f64,
    thresholds_v: Vec<f64>,
    weights: Vec<f64>,
    voltage_v: Vec<f64>,
    stiffness: Vec<f64>,
    leakage: (f64, f64),
    share: f64,
    lags: (Vec<f64>, Vec<f64>),
    high: Option<f64>,
}

prop_compose! {
    /// Up to the ends of what is accepted, signs included.
    fn numbers()(
        plays in prop::collection::vec((0.0..=1000.0f64, -1.0..=1.0f64), 0..=8),
        direct in -2.0..=2.0f64,
        lines in prop::collection::vec((0.001..125.0f64, -10.0..=10.0f64), 1..=8),
        leakage in (0.0..=1.0f64, 1.0..1e5f64),
        share in 0.0..=5.0f64,
        lags in prop::collection::vec((-1.39..4.0f64, -1.2..=1.2f64), 1..=4),
        high in prop::option::of(-1.0..=1.0f64),
    ) -> Numbers {
        let (mut voltage_v, mut stiffness) = (vec![0.0], vec![0.0]);
        for (line, (width, slope)) in lines.into_iter().enumerate() {
            voltage_v.push(voltage_v[line] + width + 1e-3);
            stiffness.push(f64::clamp(stiffness[line] + 0.999 * slope * width, -2000.0, 2000.0));
        }
        let (thresholds_v, weights) = plays.into_iter().unzip();
        let (tau, by): (Vec<f64>, Vec<f64>) = lags.into_iter().map(|(tau, weight)| (10f64.powf(tau), weight)).unzip();
        let high = high.map(|decades| (tau[0] * 10f64.powf(decades)).clamp(0.041, 9000.0));
        Numbers { direct, thresholds_v, weights, voltage_v, stiffness, leakage, share, lags: (tau, by), high }
    }
}

impl Numbers {
    fn plant(&self) -> ExtendedPlant<'_> {
        ExtendedPlant {
            memory: Some(Memory { direct: self.direct, thresholds_v: &self.thresholds_v, weights: &self.weights }),
            law: Some(Law { voltage_v: &self.voltage_v, stiffness: &self.stiffness }),
            leakage: Some(Leakage { share: self.leakage.0, time_constant_s: self.leakage.1 }),
            relaxation: Relaxation {
                share: self.share,
                time_constants_s: &self.lags.0,
                weights: &self.lags.1,
                time_constant_high_s: self.high,
            },
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    /// Any spring, any voltage that a type can hold, in any order.
    #[test]
    fn no_voltage_makes_a_spring_wrap(
        numbers in numbers(),
        rate in 2.0..=4.0f64,
        voltages in prop::collection::vec(-2000.0..=2000.0f64, 1..40),
    ) {
        let (plant, sample_time) = (numbers.plant(), SampleTime::from_rate(10f64.powf(rate)).unwrap());
        prop_assert_eq!(plant.check(sample_time), Ok(()));
        let config = plant.scaled(sample_time);
        let mut state = extended::State::default();
        for voltage in voltages {
            for _ in 0..50 {
                config.run(&mut state, Volts::new(voltage).unwrap());
            }
        }
    }

    /// The whole loop on springs that no controller can handle, springs and gains changing: the output stays in range.
    #[test]
    fn nothing_gets_out_of_the_range(
        loops in prop::collection::vec((numbers(), -3.0..2.0f64, -4.0..2.0f64), 1..4),
        slew in prop::option::of(0.0..9.0f64),
        targets in prop::collection::vec(-2000.0..2000.0f64, 1..20),
    ) {
        let mut state = Running::default();
        for (numbers, proportional, integral) in loops {
            let compensation = gains(10f64.powf(proportional), 10f64.powf(integral));
            let amplifier = Amplifier { slew_v_per_s: slew.map(|decades| 10f64.powf(decades)), ..Amplifier::up_to(1000.0) };
            let settings = Settings { compensation, amplifier, ..settings(numbers.plant()) };
            let Ok(config) = settings.check() else { continue };
            let (lowest, highest) = config.range();
            config.adopt(&mut state, Volts::new(targets[0]).unwrap());
            for &target in &targets {
                let output = run(&config, &mut state, target, 50);
                prop_assert!(output.applied >= lowest && output.applied <= highest);
                prop_assert!(output.voltage >= lowest && output.voltage <= highest);
            }
        }
    }
}
