//! The robust pre-compensator: settings out of range, and changes of configuration and sensor without a jump of the voltage.
//! Built with overflow checks: a wrap panics. What it reaches is in `simulation/tests/robust.rs`; random settings are in
//! `time_optimal/range.rs`.

use model::{
    Amplifier, Compensation, Config, Feedback, Input, Margin, Output, Reading, ScaledStiffness, Settings, State, Volts,
};

const MARGIN: Margin = Margin { time_constant: 0.1, share: 0.1, gain: 0.1, overshoot: 0.02, fall_back: 0.0 };

fn config(compensation: Compensation, feedback: Option<Feedback>) -> Config {
    let amplifier = Amplifier::up_to(1000.0);
    Settings { compensation, amplifier, feedback, ..Settings::PAPER }.validate().unwrap().quantize()
}

fn tick(config: &Config, state: &mut State, target_v: f64, measured: Option<Reading>) -> Output {
    config.tick(state, Input { target: Volts::new(target_v).unwrap(), measured })
}

#[test]
fn a_margin_out_of_range_is_rejected_by_name() {
    for (margin, field) in [
        (Margin { time_constant: 0.26, ..MARGIN }, "margin.time_constant"),
        (Margin { share: -0.1, ..MARGIN }, "margin.share"),
        (Margin { gain: f64::NAN, ..MARGIN }, "margin.gain"),
        (Margin { overshoot: 0.3, ..MARGIN }, "margin.overshoot"),
        (Margin { fall_back: 0.6, ..MARGIN }, "margin.fall_back"),
    ] {
        let settings = Settings { compensation: Compensation::Robust(margin), ..Settings::PAPER };
        assert_eq!(settings.validate().unwrap_err().field, field);
    }
    // The quick spring's time constant is below two ticks.
    let plant = model::Plant { time_constant_s: 2.1e-3, ..model::Plant::PAPER };
    let settings = Settings { compensation: Compensation::Robust(MARGIN), plant, ..Settings::PAPER };
    assert_eq!(settings.validate().unwrap_err().field, "time_constant_s");
}

/// In the middle of a step, from any other controller and back.
#[test]
fn taking_over_does_not_move_the_voltage() {
    let robust = config(Compensation::Robust(MARGIN), None);
    let paper = config(Settings::PAPER.compensation, None);
    for (first, second) in [(&paper, &robust), (&robust, &paper), (&robust, &robust)] {
        for ticks in [1, 40, 500, 5000] {
            let mut state = State::default();
            let last = (0..ticks).map(|_| tick(first, &mut state, 300.0, None)).last().unwrap();
            second.bumpless_transfer(&mut state, Volts::new(300.0).unwrap());
            let next = tick(second, &mut state, 300.0, None);
            // A code is 0.24 V.
            let moved = next.applied.to_f64() - last.applied.to_f64();
            assert!(moved.abs() < 0.75, "after {ticks} ticks: {moved} V");
        }
    }
}

/// Without a sensor an error of the gain uses up a part of the overshoot that is allowed, on the quickest spring within the errors.
#[test]
fn an_error_of_the_gain_is_a_part_of_the_overshoot() {
    let margin = Margin { time_constant: 0.05, share: 0.05, gain: 0.01, ..Margin::TYPICAL };
    let robust = config(Compensation::Robust(margin), None);
    let (share, rate) = (1.05 / 11.0, -f64::exp_m1(-1e-3 / (0.95 * 5.5)));
    let (mut state, mut lag, mut highest) = (State::default(), 0.0, 0.0f64);
    for _ in 0..10_000 {
        let applied = tick(&robust, &mut state, 300.0, None).applied.to_f64();
        highest = highest.max(1.01 * (share * applied + (1.0 - share) * lag));
        lag += (applied - lag) * rate;
    }
    assert!((305.5..306.5).contains(&highest), "{highest} V");
}

/// A spring 10 % stiffer than the model, whose sensor goes silent at rest.
#[test]
fn a_sensor_that_falls_silent_moves_the_voltage_slowly() {
    let robust = config(Compensation::Robust(MARGIN), Some(Feedback::TYPICAL));
    let (mut state, mut stiffness, mut last) = (State::default(), 0.0, 0.0f64);
    let mut noise = [0.7, -1.1, 0.2, -0.4, 1.3, -0.7].into_iter().cycle();
    for at in 0..40_000 {
        let read = ScaledStiffness(Volts::new(1.1 * stiffness + noise.next().unwrap()).unwrap().0);
        let output = tick(&robust, &mut state, 300.0, if at < 20_000 { Reading::fresh(read) } else { None });
        stiffness = output.stiffness.to_f64() - state.correction().to_f64();
        let applied = output.applied.to_f64();
        // The correction of 27 V decays with 2 s, and the voltage follows through a share of 1/11.
        assert!(at < 20_000 || (applied - last).abs() < 1.0, "{} V in tick {at}", applied - last);
        last = applied;
    }
    assert!((stiffness - 300.0).abs() < 1.0, "without a sensor the model is at the target: {stiffness}");
}
