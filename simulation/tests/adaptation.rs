//! The adaptation in closed loop: springs that change, and sensors that fail.

use model::adaptation::{Parameters, Settings};
use model::{Amplifier, Approach, Compensation, Gains, Margin, controller};
use simulation::adaptation::{Answer, Happens, Question, SensorFault, run, sensor};
use simulation::spring_error::{Parameter, SpringError};

const RATE_HZ: f64 = 1000.0;

fn fast() -> Compensation {
    Compensation::TimeOptimal(Approach::DEAD_BEAT)
}

fn question(compensation: Compensation, happens: Happens, seed: u64) -> Question {
    let control = controller::Settings {
        rate_hz: RATE_HZ,
        compensation,
        amplifier: Amplifier::up_to(1000.0),
        feedback: Some(sensor(1.0, RATE_HZ)),
        ..controller::Settings::PAPER
    };
    Question { control, adaptation: Settings::TYPICAL, happens, steps: 12, seed }
}

fn changed(parameter: Parameter, by: f64) -> Happens {
    Happens { spring_error: SpringError::default().with(parameter, by), sensor_fault: None }
}

fn failed(fault: SensorFault) -> Happens {
    Happens { spring_error: SpringError::default(), sensor_fault: Some(fault) }
}

/// The running parameters at the beginning of the last step.
fn at_last(answer: &Answer) -> Parameters {
    let last = answer.steps.last().unwrap();
    Parameters { time_constant: last.time_constant, share: last.share, gain: last.gain }
}

/// The model alone, without its sensor, is as fast again as any controller can be.
#[test]
fn steps_are_back_at_the_shortest_possible_time_within_five_of_a_change() {
    let changes = [
        (Parameter::TimeConstant, 0.2),
        (Parameter::TimeConstant, -0.2),
        (Parameter::Share, 0.2),
        (Parameter::Share, -0.2),
        (Parameter::Gain, 0.1),
        (Parameter::Gain, -0.1),
    ];
    for (parameter, by) in changes {
        let answer = run(&question(fast(), changed(parameter, by), 31)).unwrap();
        assert!(!answer.steps[1].alone.in_time, "{parameter:?} {by}: it is off before it adapts");
        let from = answer.alone_in_time_from.unwrap_or(usize::MAX);
        assert!(from <= 6, "{parameter:?} {by}: in time from step {from} on: {answer:#?}");
        let Parameters { time_constant, share, gain } = at_last(&answer);
        let error = SpringError::default().with(parameter, by);
        for (name, ratio, true_error) in
            [("tau", time_constant, error.time_constant), ("share", share, error.share), ("gain", gain, error.gain)]
        {
            assert!((ratio / (1.0 + true_error) - 1.0).abs() < 0.01, "{parameter:?} {by}: {name} {ratio}");
        }
    }
}

#[test]
fn it_adapts_under_each_controller() {
    for compensation in
        [Compensation::ProportionalIntegral(Gains::PAPER), fast(), Compensation::Robust(Margin::TYPICAL)]
    {
        let answer = run(&question(compensation, changed(Parameter::TimeConstant, 0.15), 32)).unwrap();
        assert!((at_last(&answer).time_constant - 1.15).abs() < 0.01, "{compensation:?}: {answer:#?}");
    }
}

#[test]
fn a_bad_sensor_and_a_spring_that_does_not_change_move_nothing() {
    let faults = [SensorFault::Stuck, SensorFault::Offset, SensorFault::Drift, SensorFault::Noise];
    for happens in faults.map(failed).into_iter().chain([Happens::default()]) {
        for seed in 33..36 {
            let answer = run(&question(fast(), happens, seed)).unwrap();
            assert_eq!((answer.exchanges, answer.largest_deviation), (0, 0.0), "{happens:?}, seed {seed}");
        }
    }
}

/// A change of 40 % where 25 % are allowed.
#[test]
fn a_change_beyond_the_bounds_goes_back_to_the_stored_model() {
    let answer = run(&Question { steps: 24, ..question(fast(), changed(Parameter::TimeConstant, 0.4), 36) }).unwrap();
    assert!(answer.largest_deviation <= 0.25 + 1e-12, "{answer:#?}");
    if answer.exchanges > 0 {
        assert_eq!(at_last(&answer), Parameters::STORED, "{answer:#?}");
        assert_eq!(answer.steps.last().unwrap().phase, "stopped");
    }
}
