//! Tests of measured feedback: comparison with a reference in double precision that shares no code with it, and
//! behaviour at the bounds. They are built with overflow checks: a wrap panics.

use model::feedback::{Fault, fault_detection};
use model::{Config, Feedback, Input, Plant, Reading, ScaledStiffness, Sensor, Settings, State, Volts};
use proptest::prelude::*;
use random_numbers::Lcg64;

mod reference;
use reference::Reference;

fn reading(read_v: f64, age: u16) -> Reading {
    Reading { stiffness: ScaledStiffness(Volts::new(read_v).unwrap().0), age }
}

fn with(feedback: Feedback) -> Settings {
    Settings { feedback: Some(feedback), ..Settings::PAPER }
}

/// Behaviour of the sensor during one segment.
#[derive(Clone, Copy, Debug)]
enum Segment {
    /// No readings.
    Absent,
    /// The model's stiffness times a gain plus an offset, with noise of an amplitude, and the age in ticks.
    Fresh(f64, f64, f64, u16),
    /// One value, repeated in every tick.
    Stuck(f64),
    /// One sample that gets older with each tick.
    Ageing(f64),
    /// The model's stiffness plus and minus an offset, alternating.
    Alternating(f64),
}

fn segment() -> impl Strategy<Value = Segment> {
    prop_oneof![
        Just(Segment::Absent),
        (0.7..1.3f64, -20.0..20.0f64, 0.0..3.0f64, 0u16..14).prop_map(|(a, b, c, d)| Segment::Fresh(a, b, c, d)),
        (-100.0..800.0f64).prop_map(Segment::Stuck),
        (0.0..500.0f64).prop_map(Segment::Ageing),
        (0.0..300.0f64).prop_map(Segment::Alternating),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Random sensors: both trust them in the same ticks, and correct by the same voltage.
    #[test]
    fn trust_and_correction_agree_with_the_reference_in_double_precision(
        rate_hz in prop_oneof![Just(100.0), Just(1000.0), Just(10_000.0)],
        noise_v in 0.1..3.0f64,
        model_uncertainty in 0.1..30.0f64,
        (fastest_s, fade_s) in (0.0..1.0f64, 0.05..3.0f64),
        (every, oldest) in (1u32..5, 0u32..20),
        segments in prop::collection::vec((segment(), 1u32..400, 0.0..700.0f64), 1..12),
        seed: u64,
    ) {
        let interval_s = (f64::from(every) / rate_hz).min(0.1);
        let oldest_s = f64::from(oldest) / rate_hz;
        let typical = Feedback::TYPICAL;
        let feedback = Feedback { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, fade_s, ..typical };
        let config = Settings { rate_hz, ..with(feedback) }.validate().unwrap().quantize();
        let (mut state, mut reference) = (State::default(), Reference::new(&feedback, rate_hz));
        let (mut model, mut numbers, mut sign, mut age) = (0.0, Lcg64::new(seed), 1.0, 0u16);
        for (segment, ticks, target) in segments {
            for _ in 0..ticks {
                // From -1 to 1.
                let noise = 2.0 * numbers.uniform() - 1.0;
                age = age.saturating_add(1);
                let measured = match segment {
                    Segment::Absent => None,
                    Segment::Fresh(gain, offset, amplitude, age) => {
                        Some(reading((gain * model + offset + amplitude * noise).clamp(-1900.0, 1900.0), age))
                    }
                    Segment::Stuck(at) => Some(reading(at, 0)),
                    Segment::Ageing(at) => Some(reading(at, age)),
                    Segment::Alternating(by) => {
                        sign = -sign;
                        Some(reading((model + sign * by).clamp(-1900.0, 1900.0), 0))
                    }
                };
                if !matches!(segment, Segment::Ageing(_)) {
                    age = 0;
                }
                let output = config.tick(&mut state, Input { target: Volts::new(target).unwrap(), measured });
                reference.update(target, measured.map(|it| (it.stiffness.to_f64(), u32::from(it.age))));
                let correction = state.correction().to_f64();
                let trusted = output.sensor == Some(Sensor::Trusted);
                prop_assert_eq!(trusted, reference.trusted(), "{:?} {:?}", segment, reference);
                prop_assert!((correction - reference.correction()).abs() < 1e-3, "{correction} {reference:?}");
                model = output.stiffness.to_f64() - correction;
                reference.track_model(model);
            }
        }
    }

    /// Random bits as readings, with settings at the ends of their ranges.
    #[test]
    fn no_reading_makes_the_loop_overflow_or_leave_the_range(
        share in 0.0..=0.9f64,
        noise_v in prop_oneof![Just(0.001), Just(100.0)],
        fastest_s in prop_oneof![Just(0.0), Just(100.0)],
        readings in prop::collection::vec((any::<i32>(), 0u16..40, any::<bool>(), -2000.0..2000.0f64), 1..60),
    ) {
        let range = Feedback { lowest_v: -1000.0, highest_v: 1000.0, ..Feedback::TYPICAL };
        let feedback = Feedback { noise_v, fastest_s, model_uncertainty: 1000.0, fade_s: 0.01, ..range };
        let plant = Plant { share, time_constant_s: 0.01 };
        let settings = Settings { plant, compensation: model::Compensation::None, ..with(feedback) };
        let config = settings.validate().unwrap().quantize();
        let (lowest, highest) = config.range();
        let mut state = State::default();
        for (bits, age, often, target) in readings {
            for k in 0..if often { 120i32 } else { 1 } {
                let stiffness = ScaledStiffness(fixed::types::I12F20::from_bits(bits.wrapping_add(k)));
                let measured = Some(Reading { stiffness, age });
                let output = config.tick(&mut state, Input { target: Volts::new(target).unwrap(), measured });
                prop_assert!(output.applied >= lowest && output.applied <= highest);
            }
        }
    }
}

/// A sensor without readings changes no bit.
#[test]
fn a_sensor_without_readings_leaves_the_loop_unchanged() {
    let (without, with_sensor) =
        (Settings::PAPER.validate().unwrap().quantize(), with(Feedback::TYPICAL).validate().unwrap().quantize());
    let (mut one, mut other) = (State::default(), State::default());
    for tick in 0..20_000u32 {
        let input = Input { target: Volts::new(f64::from(tick / 5000) * 130.0).unwrap(), ..Input::default() };
        let (a, b) = (without.tick(&mut one, input), with_sensor.tick(&mut other, input));
        assert_eq!((a.code, a.voltage, a.stiffness, a.limits), (b.code, b.voltage, b.stiffness, b.limits));
        assert_eq!((a.sensor, b.sensor), (None, Some(Sensor::Failed(Fault::Absent))));
    }
}

/// The loop with a spring of nine tenths of the model's stiffness, and its sensor.
struct Bench {
    config: Config,
    state: State,
    model: f64,
    voltage: f64,
    /// Largest change of the voltage from tick to tick, in V, since this was last set to 0.
    bump: f64,
    tick: u32,
}

impl Bench {
    fn settled() -> Self {
        let (config, state) = (with(Feedback::TYPICAL).validate().unwrap().quantize(), State::default());
        let mut bench = Self { config, state, model: 0.0, voltage: 0.0, bump: 0.0, tick: 0 };
        for _ in 0..40_000 {
            bench.step(300.0, |bench| Some(reading(bench.truth(), 0)));
        }
        bench.bump = 0.0;
        bench
    }

    /// Returns the spring's stiffness, in V, plus 0.5 mV of noise, so that no reading equals the one before.
    fn truth(&self) -> f64 {
        0.9 * self.model + 0.0005 * f64::from(self.tick % 2)
    }

    fn step(&mut self, target: f64, read: impl Fn(&Self) -> Option<Reading>) -> Option<Sensor> {
        self.tick += 1;
        let input = Input { target: Volts::new(target).unwrap(), measured: read(self) };
        let output = self.config.tick(&mut self.state, input);
        self.model = output.stiffness.to_f64() - self.state.correction().to_f64();
        self.bump = self.bump.max((output.voltage.to_f64() - self.voltage).abs());
        self.voltage = output.voltage.to_f64();
        output.sensor
    }

    /// Returns the number of ticks until the sensor has this state; 1000 at most.
    fn until(&mut self, target: f64, sensor: Sensor, read: impl Fn(&Self) -> Option<Reading>) -> u32 {
        (1..1000).find(|_| self.step(target, &read) == Some(sensor)).expect("within a second")
    }
}

#[test]
fn the_measured_stiffness_reaches_the_target_with_a_wrong_model() {
    let bench = Bench::settled();
    // One DAC code is 0.17 V.
    assert!((bench.truth() - 300.0).abs() < 0.05, "{}", bench.truth());
    assert!((bench.model - 300.0 / 0.9).abs() < 0.05);
}

/// The correction decays and returns without a jump of the voltage.
#[test]
fn every_fault_is_detected_within_its_documented_time_and_without_a_bump() {
    let feedback = Feedback::TYPICAL;
    let silence = fault_detection::MISSED_INTERVALS + (feedback.oldest_s * 1000.0).round() as u32 + 1;
    type Read = fn(&Bench) -> Option<Reading>;
    let cases: [(Fault, u32, Read); 4] = [
        (Fault::Absent, silence, |_| None),
        (Fault::Stale, silence, |bench| Some(reading(bench.truth(), 11))),
        (Fault::Jumping, u32::from(fault_detection::REJECTED), |bench| Some(reading(bench.truth() + 20.0, 0))),
        (Fault::OutOfRange, u32::from(fault_detection::REJECTED), |_| Some(reading(1001.0, 0))),
    ];
    for (fault, within, read) in cases {
        let mut bench = Bench::settled();
        let found = bench.until(300.0, Sensor::Failed(fault), read);
        assert!(found <= within, "{fault:?} after {found} ticks, not {within}");
        for _ in 0..20_000 {
            assert_eq!(bench.step(300.0, read), Some(Sensor::Failed(fault)));
        }
        // The loop runs on the model alone.
        assert!((bench.truth() - 270.0).abs() < 0.2, "{fault:?} {}", bench.truth());
        if fault == Fault::Jumping {
            // The level before the jump is forgotten after this time.
            continue;
        }
        let back = bench.until(300.0, Sensor::Trusted, |bench| Some(reading(bench.truth(), 0)));
        assert!(back <= u32::from(fault_detection::TRUSTED) + 1, "{fault:?} trusted after {back} ticks");
        for _ in 0..40_000 {
            bench.step(300.0, |bench| Some(reading(bench.truth(), 0)));
        }
        assert!((bench.truth() - 300.0).abs() < 0.05);
        assert!(bench.bump < 1.0, "{fault:?}: {} V from one tick to the next", bench.bump);
    }
}

#[test]
fn a_stuck_sensor_is_detected_at_rest_and_earlier_while_the_model_moves() {
    for (target, within) in [(300.0, fault_detection::IDENTICAL_AT_REST), (400.0, fault_detection::IDENTICAL)] {
        let mut bench = Bench::settled();
        let (stuck, start) = (Some(reading(bench.truth(), 0)), bench.model);
        let found = bench.until(target, Sensor::Failed(Fault::Stuck), |_| stuck);
        let moved = (bench.model - start).abs();
        assert!(found <= u32::from(within) || (within == fault_detection::IDENTICAL && moved < 6.5), "{found} {moved}");
    }
}

/// Rounding as coarse as the settings allow: to twice the noise, starting from the middle of a step.
#[test]
fn a_sensor_that_rounds_to_twice_its_noise_stays_trusted() {
    let (mut bench, mut numbers) = (Bench::settled(), Lcg64::new(1));
    // Rounding to 2 V contributes 0.577 V of the noise of 1 V.
    let white_v = (1.0f64 - 4.0 / 12.0).sqrt();
    for tick in 0..100_000 {
        let noise = numbers.normal();
        let rounded = |bench: &Bench| Some(reading(2.0 * ((bench.truth() + white_v * noise) / 2.0).round(), 0));
        assert_eq!(bench.step(300.0, rounded), Some(Sensor::Trusted), "tick {tick}");
    }
}

/// Readings that alternate during a step: no spring does that.
#[test]
fn alternating_readings_are_detected_while_the_model_moves() {
    let mut bench = Bench::settled();
    for _ in 0..50 {
        bench.step(400.0, |bench| Some(reading(bench.truth(), 0)));
    }
    let alternating =
        |bench: &Bench| Some(reading(bench.truth() + if bench.tick.is_multiple_of(2) { 30.0 } else { -30.0 }, 0));
    let found = bench.until(400.0, Sensor::Failed(Fault::Jumping), alternating);
    assert!(found <= u32::from(fault_detection::REJECTED), "{found}");
}

/// One reading in ten is wrong by 200 V.
#[test]
fn outliers_neither_correct_the_model_nor_are_a_fault() {
    let mut bench = Bench::settled();
    for k in 0..10_000 {
        let off = if k % 10 == 0 { 200.0 } else { 0.0 };
        assert_eq!(bench.step(300.0, |bench| Some(reading(bench.truth() + off, 0))), Some(Sensor::Trusted));
        assert!((bench.truth() - 300.0).abs() < 0.05);
    }
}

/// The share is more than twice the model's, under steps of 100 V with full overshoot.
#[test]
fn a_wrong_share_of_the_model_is_not_a_fault_of_the_sensor() {
    let mut bench = Bench::settled();
    for k in 0..20_000 {
        let target = if k % 4000 < 2000 { 400.0 } else { 300.0 };
        let more = |bench: &Bench| Some(reading(bench.truth() + 0.11 * (bench.voltage - bench.model), 0));
        assert_eq!(bench.step(target, more), Some(Sensor::Trusted), "tick {k}");
    }
}

#[test]
fn a_transfer_to_other_sensor_settings_or_to_none_is_bumpless() {
    for feedback in [None, Some(Feedback { noise_v: 5.0, ..Feedback::TYPICAL })] {
        let mut bench = Bench::settled();
        bench.config = Settings { feedback, ..Settings::PAPER }.validate().unwrap().quantize();
        bench.config.bumpless_transfer(&mut bench.state, Volts::new(300.0).unwrap());
        bench.step(300.0, |_| None);
        assert!(bench.bump < 0.01, "{feedback:?}: {} V", bench.bump);
    }
}

/// Arming then starts with the sensor's correction, and with what is known of the sensor's faults.
#[test]
fn the_sensor_is_heard_while_the_amplifier_is_off() {
    let config = with(Feedback::TYPICAL).validate().unwrap().quantize();
    let mut state = State::default();
    let mut rest = |read_v: f64| {
        let mut output = config.rest(&mut state, None);
        for tick in 0..20_000 {
            // Noise of 0.5 mV, so that no reading equals the one before.
            output = config.rest(&mut state, Some(reading(read_v + 0.0005 * f64::from(tick % 2), 0)));
        }
        (output, state.correction().to_f64())
    };
    let (output, correction_v) = rest(20.0);
    assert_eq!(output.sensor, Some(Sensor::Trusted));
    assert!((correction_v - 20.0).abs() < 0.1, "{correction_v} V instead of the sensor's 20 V");
    assert!((output.stiffness.to_f64() - 20.0).abs() < 0.1);
    let (output, correction_v) = rest(1900.0);
    assert!(matches!(output.sensor, Some(Sensor::Failed(_))), "{output:?}");
    assert!(correction_v.abs() < 0.1, "{correction_v} V from a sensor that has failed");
}
