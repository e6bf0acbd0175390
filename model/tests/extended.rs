//! Tests of the whole tick with an extended spring, over the whole range of accepted settings. They are built with
//! overflow checks: a wrap panics.

mod springs;

use model::estimator::{Estimator, Model};
use model::extended::{self, ExtendedPlant, Law, Leakage, Memory, Relaxation};
use model::{
    Amplifier, Compensation, Config, Gains, Input, Limits, Plant, SampleTime, Settings, State, Validate, Volts,
};
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

/// A target is limited to the amplifier's range. A spring of a smaller static gain ends at the upper limit, which is
/// reported; one of a larger static gain could reach more than the range, but the target is moved to its end.
#[test]
fn an_unreachable_target_ends_at_the_upper_limit() {
    for (leak, gain, target_v, ends_v) in [(0.3, 0.9, 650.0, 490.0), (0.0, 1.2, 800.0, 700.0)] {
        let leakage = Some(Leakage { share: leak, time_constant_s: 20.0 });
        let relaxation = Relaxation { weights: &[gain], share: 0.1, ..PLAIN.relaxation };
        let plant = ExtendedPlant { leakage, relaxation, ..PLAIN };
        let (config, mut state) = (settings(plant).validate().unwrap().quantize(), Running::default());
        let output = run(&config, &mut state, target_v, 300_000);
        assert!((output.stiffness.to_f64() - ends_v).abs() < 0.5, "{output:?}");
        let (beyond, moved) = (leak > 0.0, gain > 1.0);
        assert_eq!(
            (output.limits.intersects(Limits::UPPER), output.limits.intersects(Limits::TARGET)),
            (beyond, moved)
        );
    }
}

/// A plain spring that runs as an extended one differs by rounding only.
#[test]
fn an_extended_plant_without_blocks_runs_as_the_plain_plant() {
    let (plain, extended) =
        (Settings::PAPER.validate().unwrap().quantize(), settings(PLAIN).validate().unwrap().quantize());
    assert_eq!(PLAIN.plain(), Some(Plant::PAPER));
    assert_eq!(WHOLE.plain(), None);
    let (mut state, mut other) = (State::default(), Running::default());
    for target_v in [100.0, 500.0, 333.3, 0.0] {
        for _ in 0..5000 {
            let input = Input { target: Volts::new(target_v).unwrap(), ..Input::default() };
            let (one, two) = (plain.tick(&mut state, input), extended.tick(&mut other, input));
            let off = (one.stiffness.to_f64() - two.stiffness.to_f64()).abs();
            // One code of 0.17 V, where both voltages are half-way between two codes.
            assert!(off < 0.02 && one.code.0.abs_diff(two.code.0) <= 1, "{off} V: {one:?} {two:?}");
        }
    }
}

/// The loop linearises the spring's curve with its largest slope, and converges to the exact solution of
/// `u + Kp y(u) = ...` at the rate that the documentation of the pre-compensator states.
#[test]
fn the_voltage_converges_to_the_solution_on_the_curve_at_the_documented_rate() {
    // Without integral action nothing else moves within 12 ticks.
    let compensation = gains(4.0, 0.0);
    // The law is four times as steep above 200 V.
    let law = Law { voltage_v: &[0.0, 200.0, 400.0], stiffness: &[0.0, 100.0, 500.0] };
    let relaxation = Relaxation { time_constants_s: &[5000.0], ..PLAIN.relaxation };
    let plant = ExtendedPlant { law: Some(law), relaxation, ..PLAIN };
    let amplifier = Amplifier { dac_bits: 16, ..Amplifier::PAPER };
    let config = Settings { compensation, amplifier, ..settings(plant) }.validate().unwrap().quantize();
    let mut state = Running::default();
    // On the flat part: u (1 + 4 / 11 / 2) = 4 * 40.
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

/// After a minute at a limit, the response to a lower target is that of a loop that was never limited.
#[test]
fn the_integrator_does_not_wind_up() {
    let answer = |max_v, first| {
        let amplifier = Amplifier { max_v, ..Amplifier::PAPER };
        let config = Settings { amplifier, ..settings(WHOLE) }.validate().unwrap().quantize();
        let mut state = Running::default();
        let held = run(&config, &mut state, first, 60_000);
        assert_eq!(held.limits.intersects(Limits::UPPER), max_v < 700.0, "{held:?}");
        (
            held.stiffness.to_f64(),
            [100, 500, 1000, 3500].map(|ticks| run(&config, &mut state, 200.0, ticks).stiffness.to_f64()),
        )
    };
    // The unlimited loop gets the stiffness that the limited one reaches as its target.
    let (reached, limited) = answer(400.0, 395.0);
    let (_, free) = answer(700.0, reached);
    for (limited, free) in limited.into_iter().zip(free) {
        assert!((limited - free).abs() < 0.5, "{limited} {free}");
    }
}

#[test]
fn a_transfer_to_new_gains_springs_or_rates_is_bumpless() {
    let before = settings(WHOLE).validate().unwrap().quantize();
    let slower = Relaxation { time_constants_s: &[7.0, 70.0], ..WHOLE.relaxation };
    for other in [
        Settings { compensation: gains(12.0, 0.3), ..settings(WHOLE) },
        settings(ExtendedPlant { leakage: None, relaxation: slower, ..WHOLE }),
        Settings { rate_hz: 5000.0, ..settings(WHOLE) },
    ] {
        let after = other.validate().unwrap().quantize();
        let mut state = Running::default();
        let last = run(&before, &mut state, 150.0, 700);
        after.bumpless_transfer(&mut state, Volts::new(150.0).unwrap());
        let next = run(&after, &mut state, 150.0, 1);
        let bump = (next.voltage.to_f64() - last.voltage.to_f64()).abs();
        assert!(bump < 1e-4, "{other:?}: {bump} V");
    }
}

/// At rest at 10 kHz.
#[test]
fn the_code_stays_within_one_step_for_two_million_ticks_at_rest() {
    let plant = ExtendedPlant { leakage: None, ..WHOLE };
    let config = Settings { rate_hz: 10_000.0, ..settings(plant) }.validate().unwrap().quantize();
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
    /// Settings up to the ends of their allowed ranges, both signs included.
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

    /// Random springs, and random voltages over the whole range of `Volts`.
    #[test]
    fn no_sequence_of_voltages_makes_a_spring_overflow(
        numbers in numbers(),
        rate in 2.0..=4.0f64,
        voltages in prop::collection::vec(-2000.0..=2000.0f64, 1..40),
    ) {
        let (plant, sample_time) = (numbers.plant(), SampleTime::from_rate(10f64.powf(rate)).unwrap());
        let config = plant.validate(sample_time).unwrap().quantize();
        let mut state = extended::State::default();
        for voltage in voltages {
            for _ in 0..50 {
                config.run(&mut state, Volts::new(voltage).unwrap());
            }
        }
    }

    /// The whole loop with changing gains and springs, most of which no controller can handle.
    #[test]
    fn the_output_stays_in_range(
        loops in prop::collection::vec((numbers(), -3.0..2.0f64, -4.0..2.0f64), 1..4),
        slew in prop::option::of(0.0..9.0f64),
        targets in prop::collection::vec(-2000.0..2000.0f64, 1..20),
    ) {
        let mut state = Running::default();
        for (numbers, proportional, integral) in loops {
            let compensation = gains(10f64.powf(proportional), 10f64.powf(integral));
            let amplifier = Amplifier { slew_v_per_s: slew.map(|decades| 10f64.powf(decades)), ..Amplifier::up_to(1000.0) };
            let settings = Settings { compensation, amplifier, ..settings(numbers.plant()) };
            let Ok(valid) = settings.validate() else { continue };
    let config = valid.quantize();
            let (lowest, highest) = config.range();
            config.bumpless_transfer(&mut state, Volts::new(targets[0]).unwrap());
            for &target in &targets {
                let output = run(&config, &mut state, target, 50);
                prop_assert!(output.applied >= lowest && output.applied <= highest);
                prop_assert!(output.voltage >= lowest && output.voltage <= highest);
            }
        }
    }
}
