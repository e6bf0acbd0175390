//! Tests of what a sensor changes, and of changes of the configuration that move neither voltage nor estimate.

use super::*;
use crate::robust::Phase;

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

/// Springs that are known to 5 % of their time constant, and may fall back by a quarter of a step.
const FALLING_BACK: Margin = Margin { share: 0.0, fall_back: 0.25, ..Margin::TYPICAL };
/// The robust controller of these springs, without a sensor.
const ROBUST: Settings = Settings {
    compensation: Compensation::Robust(FALLING_BACK),
    amplifier: Amplifier::up_to(1000.0),
    ..Settings::PAPER
};
/// A code of its converter, in V.
const CODE_V: f64 = 1000.0 / 4095.0;

/// A controller and the spring that it drives.
struct Driven {
    config: Config,
    state: State,
    last: Output,
    lag_v: f64,
    rate: f64,
    /// Stiffness of the spring just before the next tick, in V.
    stiffness_v: f64,
    ticks: i32,
}

impl Driven {
    /// The time constant of the spring is that of the model times `factor`.
    fn at_rest(settings: &Settings, factor: f64) -> Self {
        let config = quantized(settings);
        let mut state = State::default();
        let last = config.rest(&mut state, None);
        let rate = -(-1e-3 / (factor * Plant::PAPER.time_constant_s)).exp_m1();
        Self { config, state, last, lag_v: 0.0, rate, stiffness_v: 0.0, ticks: 0 }
    }

    /// Runs a tick, in which the sensor is read or not. Returns the change of the voltage, in V.
    fn tick(&mut self, target_v: f64, reads: bool) -> f64 {
        let noise_v = 0.1 * f64::from(self.ticks % 3 - 1);
        let stiffness = ScaledStiffness(Signal::from_num(self.stiffness_v + noise_v));
        let measured = reads.then_some(Reading { stiffness, age: 0 });
        let output = self.config.tick(&mut self.state, Input { measured, ..input(target_v) });
        let applied_v = output.applied.to_f64();
        self.lag_v += (applied_v - self.lag_v) * self.rate;
        self.stiffness_v = Plant::PAPER.share * applied_v + (1.0 - Plant::PAPER.share) * self.lag_v;
        self.ticks += 1;
        let moved_v = output.voltage.to_f64() - self.last.voltage.to_f64();
        self.last = output;
        moved_v
    }

    /// Runs for some ticks, which change nothing that a test looks at.
    fn run(&mut self, ticks: u32, target_v: f64, reads: bool) {
        for _ in 0..ticks {
            self.tick(target_v, reads);
        }
    }

    /// Runs without a sensor until the step is in a phase, and a tenth of a second more.
    fn run_into(&mut self, target_v: f64, is_there: fn(Phase) -> bool) {
        let came = (0..10_000).any(|_| {
            self.tick(target_v, false);
            is_there(self.phase())
        });
        self.run(100, target_v, false);
        assert!(came && is_there(self.phase()), "{:?}", self.phase());
    }

    fn phase(&self) -> Phase {
        self.state.robust.phase()
    }
}

fn is_before(phase: Phase) -> bool {
    matches!(phase, Phase::Before(_))
}

fn is_back(phase: Phase) -> bool {
    matches!(phase, Phase::Back(_))
}

fn is_over(phase: Phase) -> bool {
    phase == Phase::Over
}

/// Robust settings that may take over from [`ROBUST`].
fn others() -> [Settings; 6] {
    let margin = |margin| Settings { compensation: Compensation::Robust(margin), ..ROBUST };
    let amplifier = |amplifier| Settings { amplifier, ..ROBUST };
    [
        ROBUST,
        margin(Margin { fall_back: 0.0, ..FALLING_BACK }),
        margin(Margin { time_constant: 0.07, fall_back: 0.5, ..FALLING_BACK }),
        Settings { plant: Plant { share: 0.1, time_constant_s: 5.0 }, ..ROBUST },
        amplifier(Amplifier { slew_v_per_s: Some(300.0), ..ROBUST.amplifier }),
        amplifier(Amplifier { max_v: 950.0, ..ROBUST.amplifier }),
    ]
}

/// What is left to the target is made with the 0.1 s of the offset, through the share, while the voltage settles with 0.4 s or more.
#[test]
fn settings_that_take_over_in_any_phase_of_a_fall_back_end_it_without_a_bump() {
    for (from_v, target_v) in [(0.0, 100.0), (400.0, 300.0)] {
        for (settings, is_there) in
            others().iter().flat_map(|it| [is_before, is_back, is_over].map(|phase| (it, phase)))
        {
            let mut driven = Driven::at_rest(&ROBUST, 1.0);
            driven.run(30_000, from_v, false);
            driven.run_into(target_v, is_there);
            let (context, last_v) = ((target_v, driven.phase(), settings), driven.last.voltage.to_f64());
            driven.config = quantized(settings);
            driven.config.bumpless_transfer(&mut driven.state, input(target_v).target);
            let missing_v = (driven.config.present(&driven.state).to_f64() - target_v).abs();
            let most_v = missing_v / settings.plant.share * 0.01 + (last_v - target_v).abs() / 400.0 + CODE_V;
            let slew_v = settings.amplifier.slew_v_per_s.map_or(f64::MAX, |slew| slew / settings.rate_hz);
            let first_v = driven.tick(target_v, false);
            assert!(first_v.abs() < 0.5, "{first_v} V {context:?}");
            for _ in 0..40_000 {
                let moved_v = driven.tick(target_v, false);
                assert!(moved_v.abs() <= most_v.min(slew_v + 1e-3), "{moved_v} V of {most_v} {context:?}");
                let voltage = driven.last.voltage.to_f64();
                assert!((0.0..=settings.amplifier.max_v).contains(&voltage), "{voltage} V {context:?}");
                assert_eq!(driven.phase(), Phase::Never, "{context:?}");
            }
            let rests_v = driven.last.stiffness.to_f64();
            assert!((rests_v - target_v).abs() < 0.1, "{rests_v} V {context:?}");
            driven.tick(350.0, false);
            assert!(is_before(driven.phase()), "the next step may fall back: {:?} {context:?}", driven.phase());
        }
    }
}

/// A spring that takes over goes on from the stiffness as well. The sensor is there, and is not read.
#[test]
fn a_spring_that_takes_over_in_a_fall_back_ends_it() {
    let feedback = Some(Feedback::TYPICAL);
    let mut driven = Driven::at_rest(&Settings { feedback, ..ROBUST }, 1.0);
    driven.run_into(100.0, is_back);
    let stiffness = driven.config.present(&driven.state);
    driven.config = quantized(&Settings { feedback, plant: Plant { share: 0.1, time_constant_s: 5.0 }, ..ROBUST });
    driven.config.take_over(&mut driven.state, input(100.0).target, stiffness);
    assert_eq!((driven.config.present(&driven.state), driven.phase()), (stiffness, Phase::Never));
    let moved_v = driven.tick(100.0, false);
    assert!(moved_v.abs() < 0.5, "{moved_v} V");
}

/// The voltage goes back by 20 V in a tick while the sensor is trusted, or by what the amplifier allows. What is lost with the sensor goes
/// with 2 s, less than a code in a tick.
#[test]
fn a_sensor_that_comes_and_goes_in_a_fall_back_ends_it_for_this_step() {
    for (slew_v_per_s, rise_v) in [(None, 20.0), (Some(5000.0), 5.0)] {
        for (from_v, target_v, factor) in
            [(0.0, 100.0, 0.95), (0.0, 100.0, 1.0), (0.0, 100.0, 1.05), (400.0, 300.0, 0.95), (400.0, 300.0, 1.05)]
        {
            let amplifier = Amplifier { slew_v_per_s, ..ROBUST.amplifier };
            let settings = Settings { amplifier, feedback: Some(Feedback::TYPICAL), ..ROBUST };
            let mut driven = Driven::at_rest(&settings, factor);
            driven.run(60_000, from_v, false);
            driven.run_into(target_v, is_back);
            let context = (slew_v_per_s, target_v, factor);
            let (mut fastest_v, mut trusted) = (0.0f64, 0);
            for tick in 0..11_000 {
                let moved_v = driven.tick(target_v, tick < 1000);
                let part = (driven.stiffness_v - from_v) / (target_v - from_v);
                let voltage = driven.last.voltage.to_f64();
                assert!(part < 1.021 && (0.0..=1000.0).contains(&voltage), "{part} at {voltage} V {context:?}");
                trusted += i32::from(driven.last.sensor == Some(Sensor::Trusted));
                if trusted == 0 {
                    assert!(is_back(driven.phase()), "nobody has ended it: {:?} {context:?}", driven.phase());
                    continue;
                }
                assert_eq!(driven.phase(), Phase::Never, "{tick} {context:?}");
                fastest_v = fastest_v.max(moved_v.abs());
                assert!(tick < 1000 || moved_v.abs() < CODE_V, "{moved_v} V in tick {tick} {context:?}");
            }
            assert!((fastest_v - rise_v).abs() < 1e-3, "{fastest_v} V {context:?}");
            driven.run_into(target_v + 100.0, is_back);
            driven.run_into(target_v + 100.0, is_over);
        }
    }
}

/// Whenever it is lost, from the first tick of the step until long after the time of a fall back.
#[test]
fn a_step_that_begins_with_a_sensor_has_no_fall_back_once_the_sensor_is_lost() {
    for lost in [0, 10, 500, 2300, 3500] {
        let [mut with, mut without] = [0.25, 0.0].map(|fall_back| {
            let compensation = Compensation::Robust(Margin { fall_back, ..FALLING_BACK });
            let feedback = Some(Feedback::TYPICAL);
            Driven::at_rest(&Settings { compensation, feedback, ..ROBUST }, 1.05)
        });
        for (tick, target_v) in (0..8000).map(|tick| (tick, if tick < 200 { 0.0 } else { 100.0 })) {
            let reads = tick < 200 + lost.max(1);
            with.tick(target_v, reads);
            without.tick(target_v, reads);
            assert_eq!(with.last, without.last, "tick {tick}, lost after {lost}");
            assert!(tick < 200 || with.phase() == Phase::Never, "tick {tick}, lost after {lost}: {:?}", with.phase());
        }
        with.run_into(200.0, is_back);
    }
}
