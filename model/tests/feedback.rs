//! Measured feedback beside a reference in double precision that shares no code with it, and at its bounds. Built with
//! overflow checks: a wrap panics.

use model::feedback::{Fault, watch};
use model::{Config, Feedback, Input, Plant, Reading, ScaledStiffness, Sensor, Settings, State, Volts};
use proptest::prelude::*;

mod reference;
use reference::Reference;

fn reading(read_v: f64, age: u16) -> Reading {
    Reading { stiffness: ScaledStiffness(Volts::new(read_v).unwrap().0), age }
}

/// From -1 to 1.
fn uniform(random: &mut u64) -> f64 {
    *random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*random >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn with(feedback: Feedback) -> Settings {
    Settings { feedback: Some(feedback), ..Settings::PAPER }
}

/// One stretch of readings.
#[derive(Clone, Copy, Debug)]
enum Said {
    Nothing,
    /// The model's own stiffness times the factor plus the offset, and noise of the amplitude; so many ticks old.
    Fresh(f64, f64, f64, u16),
    Stuck(f64),
    /// The same sample again and again.
    Ageing(f64),
    /// Far to one side, far to the other.
    Shaken(f64),
}

fn said() -> impl Strategy<Value = Said> {
    prop_oneof![
        Just(Said::Nothing),
        (0.7..1.3f64, -20.0..20.0f64, 0.0..3.0f64, 0u16..14).prop_map(|(a, b, c, d)| Said::Fresh(a, b, c, d)),
        (-100.0..800.0f64).prop_map(Said::Stuck),
        (0.0..500.0f64).prop_map(Said::Ageing),
        (0.0..300.0f64).prop_map(Said::Shaken),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever the sensor says: trusted in the same ticks, corrected by the same volts.
    #[test]
    fn as_a_reference_in_double_precision(
        rate_hz in prop_oneof![Just(100.0), Just(1000.0), Just(10_000.0)],
        noise_v in 0.1..3.0f64,
        model_uncertainty in 0.1..30.0f64,
        (fastest_s, fade_s) in (0.0..1.0f64, 0.05..3.0f64),
        (every, oldest) in (1u32..5, 0u32..20),
        stretches in prop::collection::vec((said(), 1u32..400, 0.0..700.0f64), 1..12),
        seed: u64,
    ) {
        let interval_s = (f64::from(every) / rate_hz).min(0.1);
        let oldest_s = f64::from(oldest) / rate_hz;
        let typical = Feedback::TYPICAL;
        let feedback = Feedback { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, fade_s, ..typical };
        let config = Settings { rate_hz, ..with(feedback) }.check().unwrap();
        let (mut state, mut reference) = (State::default(), Reference::new(&feedback, rate_hz));
        let (mut model, mut random, mut shaken, mut age) = (0.0, seed, 1.0, 0u16);
        for (said, ticks, target) in stretches {
            for _ in 0..ticks {
                let noise = uniform(&mut random);
                age = age.saturating_add(1);
                let measured = match said {
                    Said::Nothing => None,
                    Said::Fresh(gain, offset, amplitude, age) => {
                        Some(reading((gain * model + offset + amplitude * noise).clamp(-1900.0, 1900.0), age))
                    }
                    Said::Stuck(at) => Some(reading(at, 0)),
                    Said::Ageing(at) => Some(reading(at, age)),
                    Said::Shaken(by) => {
                        shaken = -shaken;
                        Some(reading((model + shaken * by).clamp(-1900.0, 1900.0), 0))
                    }
                };
                if !matches!(said, Said::Ageing(_)) {
                    age = 0;
                }
                let output = config.tick(&mut state, Input { target: Volts::new(target).unwrap(), measured });
                reference.hear(target, measured.map(|it| (it.stiffness.to_f64(), u32::from(it.age))));
                let correction = state.correction().to_f64();
                prop_assert_eq!(output.sensor == Some(Sensor::Trusted), reference.trusted(), "{:?} {:?}", said, reference);
                prop_assert!((correction - reference.correction()).abs() < 1e-3, "{correction} {reference:?}");
                model = output.stiffness.to_f64() - correction;
                reference.moved(model);
            }
        }
    }

    /// The hardest readings there are, beside the hardest settings.
    #[test]
    fn nothing_wraps_and_nothing_gets_out_of_the_range(
        share in 0.0..=0.9f64,
        noise_v in prop_oneof![Just(0.001), Just(100.0)],
        fastest_s in prop_oneof![Just(0.0), Just(100.0)],
        said in prop::collection::vec((any::<i32>(), 0u16..40, any::<bool>(), -2000.0..2000.0f64), 1..60),
    ) {
        let range = Feedback { lowest_v: -1000.0, highest_v: 1000.0, ..Feedback::TYPICAL };
        let feedback = Feedback { noise_v, fastest_s, model_uncertainty: 1000.0, fade_s: 0.01, ..range };
        let plant = Plant { share, time_constant_s: 0.01 };
        let config = Settings { plant, compensation: model::Compensation::None, ..with(feedback) }.check().unwrap();
        let (lowest, highest) = config.range();
        let mut state = State::default();
        for (bits, age, often, target) in said {
            for k in 0..if often { 120i32 } else { 1 } {
                let stiffness = ScaledStiffness(fixed::types::I12F20::from_bits(bits.wrapping_add(k)));
                let measured = Some(Reading { stiffness, age });
                let output = config.tick(&mut state, Input { target: Volts::new(target).unwrap(), measured });
                prop_assert!(output.applied >= lowest && output.applied <= highest);
            }
        }
    }
}

/// A sensor that says nothing changes no bit.
#[test]
fn unheard_it_is_the_loop_without_a_sensor() {
    let (alone, deaf) = (Settings::PAPER.check().unwrap(), with(Feedback::TYPICAL).check().unwrap());
    let (mut one, mut other) = (State::default(), State::default());
    for tick in 0..20_000u32 {
        let input = Input { target: Volts::new(f64::from(tick / 5000) * 130.0).unwrap(), ..Input::default() };
        let (a, b) = (alone.tick(&mut one, input), deaf.tick(&mut other, input));
        assert_eq!((a.code, a.voltage, a.stiffness, a.limits), (b.code, b.voltage, b.stiffness, b.limits));
        assert_eq!((a.sensor, b.sensor), (None, Some(Sensor::Failed(Fault::Absent))));
    }
}

/// A spring that answers with nine tenths of the model's stiffness, and its sensor.
struct Bench {
    config: Config,
    state: State,
    model: f64,
    voltage: f64,
    /// The largest change of the voltage from tick to tick since it was last set to 0.
    bump: f64,
    tick: u32,
}

impl Bench {
    fn settled() -> Self {
        let (config, state) = (with(Feedback::TYPICAL).check().unwrap(), State::default());
        let mut bench = Self { config, state, model: 0.0, voltage: 0.0, bump: 0.0, tick: 0 };
        for _ in 0..40_000 {
            bench.step(300.0, |bench| Some(reading(bench.truth(), 0)));
        }
        bench.bump = 0.0;
        bench
    }

    /// With a noise of half a millivolt, for no reading to be the one before.
    fn truth(&self) -> f64 {
        0.9 * self.model + 0.0005 * f64::from(self.tick % 2)
    }

    fn step(&mut self, target: f64, said: impl Fn(&Self) -> Option<Reading>) -> Option<Sensor> {
        self.tick += 1;
        let input = Input { target: Volts::new(target).unwrap(), measured: said(self) };
        let output = self.config.tick(&mut self.state, input);
        self.model = output.stiffness.to_f64() - self.state.correction().to_f64();
        self.bump = self.bump.max((output.voltage.to_f64() - self.voltage).abs());
        self.voltage = output.voltage.to_f64();
        output.sensor
    }

    /// Ticks until the sensor is what it is awaited to be, at most a second.
    fn until(&mut self, target: f64, sensor: Sensor, said: impl Fn(&Self) -> Option<Reading>) -> u32 {
        (1..1000).find(|_| self.step(target, &said) == Some(sensor)).expect("within a second")
    }
}

#[test]
fn a_wrong_model_is_no_wrong_stiffness() {
    let bench = Bench::settled();
    // The DAC's code is 0.17 V.
    assert!((bench.truth() - 300.0).abs() < 0.05, "{}", bench.truth());
    assert!((bench.model - 300.0 / 0.9).abs() < 0.05);
}

/// Every fault within its stated time; the voltage goes without a bump, and comes back without one.
#[test]
fn faults_are_found_in_time_and_leave_no_bump() {
    let feedback = Feedback::TYPICAL;
    let silence = watch::SILENT + (feedback.oldest_s * 1000.0).round() as u32 + 1;
    type Says = fn(&Bench) -> Option<Reading>;
    let cases: [(Fault, u32, Says); 4] = [
        (Fault::Absent, silence, |_| None),
        (Fault::Stale, silence, |bench| Some(reading(bench.truth(), 11))),
        (Fault::Jumping, u32::from(watch::REJECTED), |bench| Some(reading(bench.truth() + 20.0, 0))),
        (Fault::OutOfRange, u32::from(watch::REJECTED), |_| Some(reading(1001.0, 0))),
    ];
    for (fault, within, says) in cases {
        let mut bench = Bench::settled();
        let found = bench.until(300.0, Sensor::Failed(fault), says);
        assert!(found <= within, "{fault:?} after {found} ticks, not {within}");
        for _ in 0..20_000 {
            assert_eq!(bench.step(300.0, says), Some(Sensor::Failed(fault)));
        }
        // On the model alone.
        assert!((bench.truth() - 270.0).abs() < 0.2, "{fault:?} {}", bench.truth());
        if fault == Fault::Jumping {
            // That long ago has become the state of things; it comes back as after any other fault.
            continue;
        }
        let back = bench.until(300.0, Sensor::Trusted, |bench| Some(reading(bench.truth(), 0)));
        assert!(back <= u32::from(watch::TRUSTED) + 1, "{fault:?} trusted after {back} ticks");
        for _ in 0..40_000 {
            bench.step(300.0, |bench| Some(reading(bench.truth(), 0)));
        }
        assert!((bench.truth() - 300.0).abs() < 0.05);
        assert!(bench.bump < 1.0, "{fault:?}: {} V from one tick to the next", bench.bump);
    }
}

/// Equal readings are a fault: soon at rest, sooner while the model moves.
#[test]
fn a_stuck_sensor_is_found_at_rest_and_sooner_by_a_movement() {
    for (target, within) in [(300.0, watch::IDENTICAL_AT_REST), (400.0, watch::IDENTICAL)] {
        let mut bench = Bench::settled();
        let (stuck, start) = (Some(reading(bench.truth(), 0)), bench.model);
        let found = bench.until(target, Sensor::Failed(Fault::Stuck), |_| stuck);
        let moved = (bench.model - start).abs();
        assert!(found <= u32::from(within) || (within == watch::IDENTICAL && moved < 6.5), "{found} {moved}");
    }
}

/// As coarse as the settings allow: twice the noise, from the middle of a step.
#[test]
fn a_rounded_sensor_is_not_stuck() {
    let (mut bench, mut random) = (Bench::settled(), 1u64);
    // Rounding to 2 V makes 0.577 V of the 1 V.
    let white_v = (1.0f64 - 4.0 / 12.0).sqrt();
    for tick in 0..100_000 {
        let noise: f64 = (0..12).map(|_| uniform(&mut random)).sum::<f64>() / 2.0;
        let rounded = |bench: &Bench| Some(reading(2.0 * ((bench.truth() + white_v * noise) / 2.0).round(), 0));
        assert_eq!(bench.step(300.0, rounded), Some(Sensor::Trusted), "tick {tick}");
    }
}

/// To one side and to the other in the midst of a step: no spring does that, so the movement is no excuse.
#[test]
fn a_shaken_sensor_is_found_while_the_model_moves() {
    let mut bench = Bench::settled();
    for _ in 0..50 {
        bench.step(400.0, |bench| Some(reading(bench.truth(), 0)));
    }
    let shaken =
        |bench: &Bench| Some(reading(bench.truth() + if bench.tick.is_multiple_of(2) { 30.0 } else { -30.0 }, 0));
    let found = bench.until(400.0, Sensor::Failed(Fault::Jumping), shaken);
    assert!(found <= u32::from(watch::REJECTED), "{found}");
}

/// One wrong reading in ten is not believed, and not answered by a fault.
#[test]
fn outliers_are_left_out() {
    let mut bench = Bench::settled();
    for k in 0..10_000 {
        let off = if k % 10 == 0 { 200.0 } else { 0.0 };
        assert_eq!(bench.step(300.0, |bench| Some(reading(bench.truth() + off, 0))), Some(Sensor::Trusted));
        assert!((bench.truth() - 300.0).abs() < 0.05);
    }
}

/// More than twice the share that the model knows, under a step of 100 V at full drive: a wrong model is no fault.
#[test]
fn a_wrong_share_is_no_jump() {
    let mut bench = Bench::settled();
    for k in 0..20_000 {
        let target = if k % 4000 < 2000 { 400.0 } else { 300.0 };
        let more = |bench: &Bench| Some(reading(bench.truth() + 0.11 * (bench.voltage - bench.model), 0));
        assert_eq!(bench.step(target, more), Some(Sensor::Trusted), "tick {k}");
    }
}

/// New settings, and none: the next voltage is the last one.
#[test]
fn a_sensor_comes_and_goes_without_a_bump() {
    for feedback in [None, Some(Feedback { noise_v: 5.0, ..Feedback::TYPICAL })] {
        let mut bench = Bench::settled();
        bench.config = Settings { feedback, ..Settings::PAPER }.check().unwrap();
        bench.config.adopt(&mut bench.state, Volts::new(300.0).unwrap());
        bench.step(300.0, |_| None);
        assert!(bench.bump < 0.01, "{feedback:?}: {} V", bench.bump);
    }
}
