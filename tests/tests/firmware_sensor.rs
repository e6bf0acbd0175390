//! The firmware's control tick in closed loop with a spring that differs from its model, with a stiffness sensor.
//!
//! `cargo xtask story --feedback` compares the emulated image with the same code.

use firmware::control::{Control, Sensors, Untimed};
use firmware::settings::{SETTINGS, SUPERVISION};
use link::Command;
use model::feedback::Fault;
use model::{Feedback, Sensor, Settings, Volts, supervisor};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use validation::closed_loop::stair;
use validation::ground_truth::{Cause, Effect, Live, Noise};

/// Length of a run, in ticks; the controller is armed in the first tick with a target of 300 V.
const TICKS: usize = 40_000;
/// Tick in which the sensor fails.
const FAILS: usize = 20_000;

/// Values of one tick.
#[derive(Clone, Copy, Debug)]
struct Moment {
    truth_v: f64,
    applied_v: f64,
    sensor: Option<Sensor>,
}

/// Distortion of a reading, in V, by the tick number; `None` for a missing reading.
type Sense = fn(usize, f64) -> Option<f64>;

fn good(_: usize, read: f64) -> Option<f64> {
    Some(read)
}

/// Runs the control tick in closed loop with a spring with the effect `cause`.
fn run_loop(feedback: Option<Feedback>, cause: Cause, sense: Sense) -> Vec<Moment> {
    let noise = Noise::white(0.2);
    let effect = Effect::draw(&mut ChaCha8Rng::seed_from_u64(1), cause, 0, &stair::schedule(), noise.sigma_v);
    let mut spring = Live::new(&[effect], noise, 1, 500.0, TICKS);
    let mut control = Control::new(&Settings { feedback, ..SETTINGS }, &SUPERVISION, None).unwrap();
    let mut measured = None;
    let tick = |number: usize| {
        let arming = (number == 0).then_some(supervisor::Command::Arm);
        let command = Command { heard: true, arming, target: Some(Volts::new(300.0).unwrap()) };
        let sensors = Sensors { interlock_closed: true, measured, ..Sensors::default() };
        let tick = control.tick(&command, &sensors, &mut Untimed);
        let applied_v = tick.output.applied.to_f64();
        let (truth_v, reading) = spring.hold(applied_v, 1e-3);
        measured = sense(number, reading.read).map(|read| Volts::new(read).unwrap());
        Moment { truth_v, applied_v, sensor: tick.output.sensor }
    };
    (0..TICKS).map(tick).collect()
}

/// Mean of true stiffness less target over the second before the tick `until`, in V.
fn error_v(moments: &[Moment], until: usize) -> f64 {
    moments[until - 1000..until].iter().map(|moment| moment.truth_v - 300.0).sum::<f64>() / 1000.0
}

#[test]
fn a_sensor_corrects_the_steady_error_of_a_wrong_model() {
    for cause in [Cause::GainError, Cause::StaticNonlinearity, Cause::ChargeLeakage] {
        let errors =
            [None, Some(Feedback::TYPICAL)].map(|feedback| error_v(&run_loop(feedback, cause, good), TICKS).abs());
        assert!(errors[0] > 5.0 && errors[1] < 0.5, "{cause}: {errors:?} V without and with the sensor");
    }
}

/// A failed sensor is detected in time and without a voltage bump; the stiffness then settles as without a sensor.
#[test]
fn after_a_sensor_failure_the_loop_settles_as_without_a_sensor() {
    let alone = run_loop(None, Cause::GainError, good);
    let cases: [(Fault, Sense); 3] = [
        (Fault::Absent, |k, read| (k < FAILS).then_some(read)),
        (Fault::Jumping, |k, read| Some(if k < FAILS { read } else { read + 30.0 })),
        (Fault::OutOfRange, |k, read| Some(if k < FAILS { read } else { 1500.0 })),
    ];
    for (fault, sense) in cases {
        let run = run_loop(Some(Feedback::TYPICAL), Cause::GainError, sense);
        let before = error_v(&run, FAILS);
        assert!(before.abs() < 0.5, "{fault:?}: {before} V before");
        assert_eq!(run[FAILS].sensor, Some(Sensor::Trusted));
        // After ten time constants of the decay; a jump is accepted later.
        let after = error_v(&run, FAILS + 16_000) - error_v(&alone, FAILS + 16_000);
        assert!(after.abs() < 0.5, "{fault:?}: {after} V from the loop without a sensor");
        let seen = run[FAILS..].iter().position(|moment| moment.sensor == Some(Sensor::Failed(fault)));
        assert!(seen.is_some_and(|ticks| ticks < 20), "{fault:?}: seen after {seen:?} ticks");
        let change = |pair: &[Moment]| (pair[1].applied_v - pair[0].applied_v).abs();
        let bump = run[FAILS - 1..].windows(2).map(change).fold(0.0, f64::max);
        assert!(bump < 1.0, "{fault:?}: the voltage changed by {bump} V in a tick");
    }
}

/// A sensor without readings has no influence; a stuck one is trusted until the model has moved by its noise.
#[test]
fn a_sensor_that_never_works_changes_the_stiffness_by_at_most_1_v() {
    let alone = run_loop(None, Cause::GainError, good);
    let dead: [(Fault, Sense, f64); 2] = [(Fault::Absent, |_, _| None, 0.0), (Fault::Stuck, |_, _| Some(0.0), 1.0)];
    for (fault, sense, most_v) in dead {
        let run = run_loop(Some(Feedback::TYPICAL), Cause::GainError, sense);
        assert!(run[1000..].iter().all(|moment| moment.sensor == Some(Sensor::Failed(fault))));
        let apart = run.iter().zip(&alone).map(|(one, other)| (one.truth_v - other.truth_v).abs()).fold(0.0, f64::max);
        assert!(apart <= most_v, "{fault:?}: the stiffness differs by up to {apart} V");
    }
}

#[test]
fn a_sensor_is_rated_while_the_output_is_disabled() {
    let settings = Settings { feedback: Some(Feedback::TYPICAL), ..SETTINGS };
    let mut control = Control::new(&settings, &SUPERVISION, None).unwrap();
    let mut hear =
        |measured| control.tick(&Command::default(), &Sensors { measured, ..Sensors::default() }, &mut Untimed);
    assert_eq!(hear(None).output.sensor, Some(Sensor::Failed(Fault::Absent)));
    let last = (0..60).map(|tick| hear(Some(Volts::new(f64::from(tick % 2)).unwrap()))).last().unwrap();
    assert_eq!(last.output.sensor, Some(Sensor::Trusted));
    assert!(!last.drive.enabled());
}
