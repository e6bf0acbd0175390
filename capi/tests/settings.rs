//! The settings of C become those of the tick, and back, without a loss.

use model::extended::{Law, Leakage, Memory, Relaxation};
use model::{Amplifier, Approach, Compensation, ExtendedPlant, Feedback, Gains, Margin, Settings};
use vsj_tick::settings::All;

const PLAIN: ExtendedPlant<'static> = ExtendedPlant {
    memory: None,
    law: None,
    leakage: None,
    relaxation: Relaxation { share: 0.1, time_constants_s: &[5.5], weights: &[], time_constant_high_s: None },
};
const FULL: ExtendedPlant<'static> = ExtendedPlant {
    memory: Some(Memory { direct: 0.9, thresholds_v: &[10.0, 20.0], weights: &[0.06, 0.04] }),
    law: Some(Law { voltage_v: &[0.0, 100.0, 700.0], stiffness: &[0.0, 90.0, 700.0] }),
    leakage: Some(Leakage { share: 0.1, time_constant_s: 40.0 }),
    relaxation: Relaxation {
        share: 0.1,
        time_constants_s: &[5.5, 40.0],
        weights: &[0.8, 0.1],
        time_constant_high_s: Some(8.0),
    },
};

fn settings(plant: ExtendedPlant<'static>) -> Settings<ExtendedPlant<'static>> {
    Settings {
        rate_hz: 500.0,
        plant,
        compensation: Compensation::ProportionalIntegral(Gains { proportional: 3.0, integral_per_s: 1.0 }),
        amplifier: Amplifier { slew_v_per_s: Some(2000.0), min_v: 10.0, max_v: 650.0, ..Amplifier::up_to(700.0) },
        feedback: Some(Feedback { interval_s: 2e-3, ..Feedback::TYPICAL }),
    }
}

#[test]
fn every_setting_of_the_tick_comes_back_from_those_of_c() {
    let full = settings(FULL);
    let fast = Compensation::TimeOptimal(Approach { time_constant_s: 0.1 });
    for settings in [
        full,
        settings(PLAIN),
        Settings { compensation: Compensation::None, feedback: None, ..full },
        Settings { compensation: fast, amplifier: Amplifier::up_to(1000.0), ..full },
        Settings { compensation: Compensation::Robust(Margin { fall_back: 0.25, ..Margin::TYPICAL }), ..full },
        settings(ExtendedPlant { leakage: None, ..FULL }),
        settings(ExtendedPlant { memory: None, law: None, ..FULL }),
    ] {
        let all = All::new(&settings);
        assert_eq!(all.settings(), Ok(settings));
        assert!(settings.validate().is_ok());
    }
    let paper = All::paper();
    assert_eq!(paper.settings().unwrap().plant.plain(), Some(Settings::PAPER.plant));
    assert_eq!(paper.settings().unwrap().compensation, Settings::PAPER.compensation);
}

#[test]
fn lists_beyond_those_of_c_and_unknown_controllers_are_refused_by_name() {
    let (mut lags, mut plays, mut points, mut controller) = (All::paper(), All::paper(), All::paper(), All::paper());
    lags.spring.lags = 5;
    plays.spring.plays = u32::MAX;
    points.spring.points = 10;
    controller.controller = 4;
    for (all, field) in [
        (lags, "relaxation.tau_s"),
        (plays, "memory.thresholds_v"),
        (points, "law.voltage_v"),
        (controller, "controller"),
    ] {
        assert_eq!(all.settings().unwrap_err().field, field);
    }
}
