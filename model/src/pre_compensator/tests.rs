use super::*;
use crate::estimator::{Model, Plant};

#[test]
fn a_gain_out_of_range_is_rejected_by_name() {
    let time = SampleTime::from_rate(1000.0).unwrap();
    let named = |proportional, integral_per_s| {
        let gains = Gains { proportional, integral_per_s };
        gains.check(&Plant::PAPER.largest_step_gain(time), time).unwrap_err().field
    };
    assert_eq!(named(-4.0, 1.35), "proportional_gain");
    assert_eq!(named(0.0, 1.35), "proportional_gain");
    assert_eq!(named(f64::NAN, 1.35), "proportional_gain");
    assert_eq!(named(4.0, -1.35), "integral_gain_per_s");
    assert_eq!(named(4.0, f64::NAN), "integral_gain_per_s");
    // The reset time is shorter than ten ticks.
    assert_eq!(named(4.0, 401.0), "integral_gain_per_s");
    // The spring would overshoot its target in every tick: it would ring.
    let slow = SampleTime::from_rate(100.0).unwrap();
    let quick = Plant { share: 0.0, time_constant_s: 0.1 }.largest_step_gain(slow);
    let error = Gains { proportional: 20.0, integral_per_s: 1.0 }.check(&quick, slow);
    assert_eq!(error.unwrap_err().field, "proportional_gain");
}

/// The spring in double precision, one tick after the other: at the highest gain that is accepted the relaxed part is at
/// its target after one tick, neither short of it nor beyond.
#[test]
fn the_highest_gain_that_is_accepted_is_dead_beat() {
    let time = SampleTime::from_rate(100.0).unwrap();
    for (share, time_constant_s) in [(0.0, 0.05), (0.0, 0.2), (0.01, 0.08), (0.05, 0.06)] {
        let plant = Plant { share, time_constant_s };
        let spring = plant.largest_step_gain(time);
        let accepted = |proportional| Gains { proportional, integral_per_s: 0.0 }.check(&spring, time).is_ok();
        let (mut low, mut high) = (0.001, 100.0);
        assert!(accepted(low) && !accepted(high), "{plant:?}");
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if accepted(middle) { low = middle } else { high = middle }
        }
        // u = Kp (target - y), y = w + share (u - w), with target 0 and w = 1.
        let voltage = -low * (1.0 - share) / (1.0 + low * share);
        let after = 1.0 + (1.0 - f64::exp(-0.01 / time_constant_s)) * (voltage - 1.0);
        assert!(after.abs() < 1e-9, "{plant:?}: {after} at {low}");
    }
    // A spring that cannot ring takes the highest gain of all.
    let slow = Plant { share: 0.5, time_constant_s: 5.0 }.largest_step_gain(time);
    assert_eq!(Gains { proportional: 100.0, integral_per_s: 0.0 }.check(&slow, time), Ok(()));
    let beyond = Gains { proportional: 100.1, integral_per_s: 0.0 }.check(&slow, time);
    assert_eq!(beyond.unwrap_err().field, "proportional_gain");
}

#[test]
fn the_reset_time_is_at_least_ten_sample_times() {
    let time = SampleTime::from_rate(1000.0).unwrap();
    let spring = Plant::PAPER.largest_step_gain(time);
    let error = |integral_per_s| Gains { proportional: 4.0, integral_per_s }.check(&spring, time);
    assert_eq!(error(400.0), Ok(()));
    assert_eq!(error(400.1).unwrap_err().field, "integral_gain_per_s");
}

#[test]
fn lowered_gains_are_accepted_for_every_spring() {
    for (rate_hz, share, time_constant_s) in
        [(1000.0, 0.1, 0.002), (1000.0, 0.0, 0.002), (100.0, 0.9, 0.02), (10_000.0, 1.0 / 11.0, 5.5), (100.0, 0.0, 0.5)]
    {
        let time = SampleTime::from_rate(rate_hz).unwrap();
        let plant = Plant { share, time_constant_s };
        let gains = Gains::lowered_for(&plant, time);
        let is_usual = Gains::PAPER.check(&plant.largest_step_gain(time), time).is_ok();
        assert_eq!((gains.check(&plant.largest_step_gain(time), time), gains == Gains::PAPER), (Ok(()), is_usual));
    }
    let time = SampleTime::from_rate(1000.0).unwrap();
    assert_eq!(Gains::with_proportional(0.001, time), Gains { proportional: 0.001, integral_per_s: 0.1 });
}
