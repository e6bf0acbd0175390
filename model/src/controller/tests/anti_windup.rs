//! Anti-windup of every controller, on plain and extended springs: what a limit leaves behind. Built with overflow checks.

use proptest::prelude::*;

use super::*;
use crate::extended::{ExtendedPlant, Law, Leakage, Memory, Relaxation};

/// Numbers of an extended spring that can be inverted, and whose hysteresis responds as soon as the voltage turns.
#[derive(Clone, Debug)]
struct Spring {
    memory: (f64, [f64; 2], [f64; 2]),
    law: ([f64; 2], [f64; 2]),
    leakage: Option<Leakage>,
    relaxation: (f64, [f64; 2], [f64; 2], Option<f64>),
}

prop_compose! {
    fn spring()(
        memory in (0.1..2.0f64, prop::array::uniform2(0.0..100.0f64), prop::array::uniform2(0.0..0.5f64)),
        law in (prop::array::uniform2(10.0..400.0f64), prop::array::uniform2(0.1..2.0f64)),
        leakage in prop::option::of((0.0..0.5f64, 1.0..1000.0f64)),
        relaxation in (
            0.0..0.9f64,
            prop::array::uniform2(0.05..50.0f64),
            prop::array::uniform2(0.1..1.0f64),
            prop::option::of(0.2..5.0f64),
        ),
    ) -> Spring {
        let leakage = leakage.map(|(share, time_constant_s)| Leakage { share, time_constant_s });
        Spring { memory, law, leakage, relaxation }
    }
}

impl Spring {
    /// Calls `then` with the spring, whose lists are borrowed.
    fn with<T>(&self, then: impl FnOnce(ExtendedPlant<'_>) -> T) -> T {
        let (direct, thresholds_v, weights) = &self.memory;
        let ([width, wider], [slope, other]) = self.law;
        let (share, time_constants_s, by, high) = &self.relaxation;
        then(ExtendedPlant {
            memory: Some(Memory { direct: *direct, thresholds_v, weights }),
            law: Some(Law {
                voltage_v: &[0.0, width, width + wider],
                stiffness: &[0.0, slope * width, slope * width + other * wider],
            }),
            leakage: self.leakage,
            relaxation: Relaxation {
                share: *share,
                time_constants_s,
                weights: by,
                time_constant_high_s: high.map(|factor| factor * time_constants_s[0]),
            },
        })
    }
}

prop_compose! {
    fn plain()(share in 0.0..0.9f64, time_constant_s in 0.05..50.0f64) -> Plant {
        Plant { share, time_constant_s }
    }
}

/// Pre-compensators, each with a state of its own.
fn compensation() -> impl Strategy<Value = Compensation> {
    let unit = || 0.0..1.0f64;
    prop_oneof![
        (0.5..20.0f64, 0.1..10.0f64).prop_map(|(proportional, integral_per_s)| {
            Compensation::ProportionalIntegral(Gains { proportional, integral_per_s })
        }),
        prop_oneof![Just(0.0), unit()].prop_map(|time| Compensation::TimeOptimal(Approach { time_constant_s: time })),
        (unit(), unit(), unit(), unit(), unit()).prop_map(|(time_constant, share, gain, overshoot, fall_back)| {
            Compensation::Robust(Margin {
                time_constant: 0.25 * time_constant,
                share: 0.25 * share,
                gain: 0.25 * gain,
                overshoot: 0.2 * overshoot,
                fall_back: 0.5 * fall_back,
            })
        }),
    ]
}

prop_compose! {
    fn amplifier()(
        full_scale_v in 200.0..=1000.0f64,
        (low, high) in (0.0..0.3f64, 0.4..=1.0f64),
        slew_v_per_s in prop::option::of(100.0..100_000.0f64),
        dac_bits in 8u32..=16,
    ) -> Amplifier {
        Amplifier { full_scale_v, min_v: low * full_scale_v, max_v: high * full_scale_v, slew_v_per_s, dac_bits }
    }
}

/// What a case varies beside the spring.
type Loop = (f64, Compensation, Amplifier);

fn controller() -> impl Strategy<Value = Loop> {
    (prop::sample::select(std::vec![100.0, 1000.0, 10_000.0]), compensation(), amplifier())
}

/// Targets beyond both ends of the range and between them, each for some ticks.
fn targets() -> impl Strategy<Value = std::vec::Vec<(f64, u32)>> {
    prop::collection::vec((-900.0..1900.0f64, 1..3000u32), 1..6)
}

/// Quantizes a case without a sensor; some gains are rejected for some springs, and some margins for some rates.
fn config<P: Model>(plant: P, (rate_hz, compensation, amplifier): Loop) -> Result<Config<P::Config>, TestCaseError> {
    validated(&Settings { rate_hz, plant, compensation, amplifier, feedback: None })
}

fn validated<P: Model>(settings: &Settings<P>) -> Result<Config<P::Config>, TestCaseError> {
    let valid = settings.validate().map_err(|error| TestCaseError::reject(std::format!("{error}")))?;
    Ok(valid.quantize())
}

/// Puts `voltage` out without asking the pre-compensator, whatever the target. Returns what was put out.
fn put_out<E: Estimator>(config: &Config<E>, state: &mut State<E::State>, input: Input, voltage: Volts) -> Volts {
    if let Some(feedback) = &config.feedback {
        let target = config.amplifier.clamp_target(input.target).0;
        let (corrected, observed) = feedback.update(&mut state.feedback, target, input.measured);
        if let PreCompensator::Robust(it) = &config.pre_compensator {
            // What it has seen of the lead follows the readings; its law is not asked.
            let mut asked = *state;
            config.robust(
                it,
                &mut asked,
                target,
                config.amplifier.clamp_target(corrected).0,
                Some((feedback, observed)),
            );
            state.robust = asked.robust.with_law_of(&state.robust);
        }
    }
    let drive = config.amplifier.drive(&mut state.amplifier, voltage, Limits::NONE);
    let model = config.estimator.run(&mut state.estimator, drive.applied);
    config.estimate(&mut state.feedback, model);
    match &config.pre_compensator {
        PreCompensator::ProportionalIntegral(it) => it.track(&mut state.pre_compensator, drive.voltage),
        PreCompensator::Robust(it) => it.run(&mut state.robust, drive.applied),
        PreCompensator::None | PreCompensator::TimeOptimal(_) => (),
    }
    drive.voltage
}

/// Asserts that after `targets` a controller answers as one that has put out the same voltages and was never limited. `read` returns
/// the sensor's next reading of a spring under the last voltage.
fn forgets<E: Estimator>(
    config: &Config<E>,
    targets: &[(f64, u32)],
    part: f64,
    mut read: impl FnMut(Volts) -> Option<Reading>,
) -> Result<(), TestCaseError> {
    let (mut limited, mut free) = (State::default(), State::default());
    let (mut acted, mut last) = (Limits::NONE, Volts::ZERO);
    for &(target_v, ticks) in targets {
        for _ in 0..ticks {
            let input = Input { measured: read(last), ..input(target_v) };
            let output = config.tick(&mut limited, input);
            acted = acted.with(output.limits);
            last = output.voltage;
            prop_assert_eq!(put_out(config, &mut free, input, last), last);
        }
    }
    prop_assume!(acted.intersects(Limits::UPPER.with(Limits::LOWER).with(Limits::SLEW)));
    let (lowest, highest) = config.range();
    let within = lowest.to_f64() + part * (highest.to_f64() - lowest.to_f64());
    for tick in 0..300 {
        let input = Input { measured: read(last), ..input(within) };
        let output = config.tick(&mut limited, input);
        last = output.voltage;
        prop_assert_eq!(output, config.tick(&mut free, input), "tick {}", tick);
    }
    Ok(())
}

/// A sensor of a spring with a gain and a time constant of its own: noise of 0.3 V, and no readings for `lost` of 1000.
#[cfg(feature = "feedback")]
fn sensor(gain: f64, time_constant_s: f64, rate_hz: f64, lost: u32) -> impl FnMut(Volts) -> Option<Reading> {
    let (mut relaxed, mut number) = (0.0, 0u32);
    move |voltage| {
        number += 1;
        relaxed += (voltage.to_f64() - relaxed) * -f64::exp_m1(-1.0 / (rate_hz * time_constant_s));
        let stiffness = gain * (0.1 * voltage.to_f64() + 0.9 * relaxed) + 0.3 * f64::from(number * 7 % 5) - 0.6;
        let read = Reading { stiffness: ScaledStiffness(Volts::new(stiffness).ok()?.0), age: 0 };
        (number % 1000 >= lost).then_some(read)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 1 } else { 300 }))]

    /// However long and far it was limited, by the range or the slew.
    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn no_controller_remembers_a_limit(
        plain in plain(),
        spring in spring(),
        controller in controller(),
        targets in targets(),
        part in 0.01..0.99f64,
    ) {
        forgets(&config(plain, controller)?, &targets, part, |_| None)?;
        spring.with(|plant| forgets(&config(plant, controller)?, &targets, part, |_| None))?;
    }

    /// The correction is what the same readings make of it, whether the voltage was limited or not.
    #[test]
    #[cfg(feature = "feedback")]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn with_a_sensor_no_controller_remembers_a_limit(
        plain in plain(),
        spring in spring(),
        controller in controller(),
        targets in targets(),
        part in 0.01..0.99f64,
        (gain, time_constant_s, lost) in (0.5..1.5f64, 0.05..50.0f64, prop_oneof![Just(0), 1..400u32]),
    ) {
        let (rate_hz, compensation, amplifier) = controller;
        let (interval_s, oldest_s) = (1.0 / rate_hz, 5.0 / rate_hz);
        let feedback = Some(Feedback { interval_s, oldest_s, ..Feedback::TYPICAL });
        let read = || sensor(gain, time_constant_s, rate_hz, lost);
        let config = validated(&Settings { rate_hz, plant: plain, compensation, amplifier, feedback })?;
        forgets(&config, &targets, part, read())?;
        spring.with(|plant| {
            let config = validated(&Settings { rate_hz, plant, compensation, amplifier, feedback })?;
            forgets(&config, &targets, part, read())
        })?;
    }

    /// No limit acts in vain: a tick in which one does ends before the target. From the first tick without, the voltage is
    /// within a code of where it rests after `ln(2^bits)` time constants of the spring's inverse.
    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn after_a_limit_the_fast_controller_rests_within_the_stated_time(
        (share, time_constant_s) in (0.01..0.9f64, 0.05..5.0f64),
        rate_hz in prop::sample::select(std::vec![100.0, 1000.0]),
        amplifier in amplifier(),
        targets in targets(),
        part in 0.05..0.95f64,
    ) {
        let amplifier = Amplifier { slew_v_per_s: None, ..amplifier };
        let fast = Compensation::TimeOptimal(Approach::DEAD_BEAT);
        let config = config(Plant { share, time_constant_s }, (rate_hz, fast, amplifier))?;
        let mut state = State::default();
        for (target_v, ticks) in targets {
            (0..ticks).for_each(|_| _ = config.tick(&mut state, input(target_v)));
        }
        let (lowest, highest) = config.range();
        let target_v = lowest.to_f64() + part * (highest.to_f64() - lowest.to_f64());
        let mut limited = 0;
        loop {
            let limits = config.tick(&mut state, input(target_v)).limits;
            let missing_v = target_v - config.present(&state).to_f64();
            if limits == Limits::NONE {
                break;
            }
            prop_assert!(if limits == Limits::UPPER { missing_v > -1e-3 } else { missing_v < 1e-3 }, "{missing_v} V");
            limited += 1;
            prop_assert!(limited < 100_000, "never reached");
        }
        prop_assume!(limited > 0);
        let seconds = f64::from(amplifier.dac_bits) * f64::ln(2.0) * (share * time_constant_s + 1.0 / rate_hz);
        (0..(seconds * rate_hz) as u32).for_each(|_| _ = config.tick(&mut state, input(target_v)));
        for _ in 0..100 {
            let codes = (config.tick(&mut state, input(target_v)).voltage.to_f64() - target_v) / amplifier.volts_per_code();
            prop_assert!(codes.abs() < 1.0, "{codes} codes");
        }
    }
}
