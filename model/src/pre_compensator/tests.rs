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

/// A quantized law for the plain spring at 1 kHz, and the same numbers in double precision: `g` and the part of its distance that the
/// integrator covers in a tick.
fn law(proportional: f64, integral_per_s: f64, share: f64) -> (ProportionalIntegral, f64, f64) {
    let time = SampleTime::from_rate(1000.0).unwrap();
    let spring = Plant { share, time_constant_s: 5.5 }.largest_step_gain(time);
    let gains = Gains { proportional, integral_per_s };
    gains.check(&spring, time).unwrap();
    let law = Validated::new(&gains, time).quantize(&spring);
    (law, 1.0 / (1.0 + proportional * share), 1e-3 * integral_per_s / proportional)
}

fn volts(volts: f64) -> Volts {
    Volts::new(volts).unwrap()
}

fn point(voltage_v: f64, stiffness_v: f64) -> OperatingPoint {
    OperatingPoint { voltage: volts(voltage_v).0, stiffness: volts(stiffness_v).0 }
}

/// The voltage is `g z + (1 - g) v0 + g Kp (target - y0)`, and the integrator a lag of the voltage that was driven. A signal has steps
/// of 1 uV, of which the largest gain here makes 20.
#[test]
fn voltage_and_integrator_are_those_of_the_law_in_double_precision() {
    for (proportional, integral_per_s, share) in [(4.0, 1.35, 1.0 / 11.0), (0.5, 50.0, 0.5), (20.0, 100.0, 0.0)] {
        let (law, g, part) = law(proportional, integral_per_s, share);
        let (mut state, mut z) = (State::default(), 0.0);
        for (target_v, v0, y0, driven_v) in
            [(30.0, 200.0, 10.0, 500.0), (25.0, -40.0, 30.0, -80.0), (0.0, 0.0, 0.0, 300.0)]
        {
            let got = law.voltage(&state, volts(target_v), point(v0, y0)).to_f64();
            let exact = g * z + (1.0 - g) * v0 + g * proportional * (target_v - y0);
            assert!((got - exact).abs() < 3e-5, "{law:?}: {got} V, {exact} V");
            law.track(&mut state, volts(driven_v));
            z += part * (driven_v - z);
        }
    }
}

/// So that no product overflows: no amplifier has a larger range.
#[test]
fn an_error_is_limited_where_it_asks_for_1024_v_and_at_1024_v() {
    for (proportional, share, within_v, most_v) in
        [(20.0, 0.0, 51.0, 1024.0), (0.5, 0.0, 1023.0, 512.0), (4.0, 0.5, 767.0, 1024.0)]
    {
        let (law, g, _) = law(proportional, 0.0, share);
        let asked =
            |error_v: f64| law.voltage(&State::default(), volts(0.5 * error_v), point(0.0, -0.5 * error_v)).to_f64();
        for sign in [-1.0, 1.0] {
            let within = asked(sign * within_v);
            assert!((within - sign * g * proportional * within_v).abs() < 3e-5, "{law:?}: {within} V");
            let beyond = asked(sign * 2000.0);
            assert!((beyond - sign * most_v).abs() < 3e-5, "{law:?}: {beyond} V");
        }
    }
}

#[test]
fn a_preset_integrator_asks_for_the_last_voltage_again() {
    let (law, ..) = law(4.0, 1.35, 1.0 / 11.0);
    for (driven_v, target_v) in [(300.0, 150.0), (-20.0, 150.0), (700.0, 0.0)] {
        let (mut state, point) = (State::default(), point(120.0, 100.0));
        law.preset_integrator(&mut state, volts(driven_v), volts(target_v), point);
        assert_eq!(law.voltage(&state, volts(target_v), point), volts(driven_v));
    }
}
