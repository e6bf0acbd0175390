//! The functions of C, called from Rust: the same outputs as the tick's, and a status for every misuse.

use model::extended::Relaxation;
use model::{
    Amplifier, Compensation, ExtendedPlant, Feedback, Input, Margin, Reading, ScaledStiffness, Settings, State, Volts,
};
use vsj_tick::functions::{
    NOT_CONFIGURED, NOT_STARTED, NULL, OK, OUT_OF_RANGE, Refused, Text, vsj_configure, vsj_explain, vsj_from_volts,
    vsj_off, vsj_paper, vsj_range, vsj_start, vsj_tick, vsj_to_volts, vsj_transfer,
};
use vsj_tick::settings::All;
use vsj_tick::slot::{ConfigSlot, StateSlot};
use vsj_tick::tick::{TickInput, TickOutput};

fn configured(settings: &All) -> ConfigSlot {
    let mut config = ConfigSlot::default();
    assert_eq!(vsj_configure(Some(&mut config), Some(settings), None), OK);
    config
}

fn started(config: &ConfigSlot) -> StateSlot {
    let mut state = StateSlot::default();
    assert_eq!(vsj_start(Some(config), Some(&mut state)), OK);
    state
}

fn tick(config: &ConfigSlot, state: &mut StateSlot, input: TickInput) -> TickOutput {
    let mut output = TickOutput::default();
    assert_eq!(vsj_tick(Some(config), Some(state), Some(&input), Some(&mut output)), OK);
    output
}

fn steps(volts: f64) -> i32 {
    let mut steps = 0;
    assert_eq!(vsj_from_volts(volts, Some(&mut steps)), OK);
    steps
}

#[test]
fn ticks_with_a_sensor_off_and_after_a_transfer_are_those_of_the_model() {
    let all = All { sensor: Feedback::TYPICAL.into(), slew_v_per_s: 5000.0, ..All::paper() };
    let (config, rust) = (configured(&all), {
        let amplifier = Amplifier { slew_v_per_s: Some(5000.0), ..Amplifier::PAPER };
        Settings { feedback: Some(Feedback::TYPICAL), amplifier, ..Settings::PAPER }
    });
    let rust = rust.validate().unwrap().quantize();
    let (mut state, mut expected) = (started(&config), State::default());
    let mut limits = 0;
    for number in 0..5000_u16 {
        let target = [300.0, 20.0, 650.0, -5.0][usize::from(number / 100 % 4)];
        let reading = 100.0 + f64::from(number % 7);
        let input = TickInput {
            target: steps(target),
            reading: steps(reading),
            reading_age: number % 3,
            has_reading: number % 2,
        };
        let measured = Reading { stiffness: ScaledStiffness(Volts::new(reading).unwrap().0), age: number % 3 };
        let measured = (number % 2 != 0).then_some(measured);
        let target = Volts::new(target).unwrap();
        let (got, expected) = if (1000..1100).contains(&number) {
            let mut output = TickOutput::default();
            assert_eq!(vsj_off(Some(&config), Some(&mut state), Some(&input), Some(&mut output)), OK);
            (output, rust.rest(&mut expected, measured))
        } else {
            if number == 1100 {
                assert_eq!(vsj_transfer(Some(&config), Some(&mut state), input.target), OK);
                rust.bumpless_transfer(&mut expected, target);
            }
            (tick(&config, &mut state, input), rust.tick(&mut expected, Input { target, measured }))
        };
        limits |= got.limits;
        assert_eq!(got, TickOutput::from(expected), "tick {number}");
    }
    assert_eq!(limits & !1, 2 | 4 | 8, "slew, lower end and target have acted");
    let (mut lowest, mut highest) = (0, 0);
    assert_eq!(vsj_range(Some(&config), Some(&mut lowest), Some(&mut highest)), OK);
    assert_eq!([vsj_to_volts(lowest), vsj_to_volts(highest)], [rust.range().0.to_f64(), rust.range().1.to_f64()]);
}

#[test]
fn ticks_of_the_robust_controller_are_those_of_the_model() {
    let relaxation =
        Relaxation { share: 0.1, time_constants_s: &[5.5, 40.0], weights: &[0.8, 0.1], time_constant_high_s: None };
    let settings = Settings {
        rate_hz: 1000.0,
        plant: ExtendedPlant { memory: None, law: None, leakage: None, relaxation },
        compensation: Compensation::Robust(Margin { gain: 0.01, ..Margin::TYPICAL }),
        amplifier: Amplifier::up_to(1000.0),
        feedback: None,
    };
    let (config, rust) = (configured(&All::new(&settings)), settings.validate().unwrap().quantize());
    let (mut state, mut expected) = (started(&config), State::default());
    for number in 0..3000 {
        let volts = [300.0, 20.0, 650.0][number / 100 % 3];
        let input = Input { target: Volts::new(volts).unwrap(), ..Input::default() };
        let got = tick(&config, &mut state, TickInput { target: steps(volts), ..TickInput::default() });
        assert_eq!(got, TickOutput::from(rust.tick(&mut expected, input)), "tick {number}");
    }
}

#[test]
fn every_misuse_has_a_status() {
    let paper = All::paper();
    let config = configured(&paper);
    let mut extended = paper;
    (extended.spring.direct, extended.spring.lags) = (0.9, 1);
    let mut of_other = started(&configured(&extended));
    let (mut state, input) = (started(&config), TickInput::default());
    let mut output = TickOutput::default();
    let (empty, mut fresh) = (ConfigSlot::default(), StateSlot::default());
    let out = &mut output;
    assert_eq!(vsj_tick(None, Some(&mut state), Some(&input), Some(out)), NULL);
    assert_eq!(vsj_tick(Some(&config), None, Some(&input), Some(out)), NULL);
    assert_eq!(vsj_tick(Some(&config), Some(&mut state), None, Some(out)), NULL);
    assert_eq!(vsj_tick(Some(&config), Some(&mut state), Some(&input), None), NULL);
    assert_eq!(vsj_tick(Some(&empty), Some(&mut state), Some(&input), Some(out)), NOT_CONFIGURED);
    assert_eq!(vsj_tick(Some(&config), Some(&mut fresh), Some(&input), Some(out)), NOT_STARTED);
    assert_eq!(vsj_tick(Some(&config), Some(&mut of_other), Some(&input), Some(out)), NOT_STARTED);
    assert_eq!(vsj_off(Some(&config), Some(&mut of_other), Some(&input), Some(out)), NOT_STARTED);
    assert_eq!(vsj_transfer(Some(&config), Some(&mut of_other), 0), NOT_STARTED);
    assert_eq!(vsj_start(Some(&empty), Some(&mut state)), NOT_CONFIGURED);
    assert_eq!(vsj_range(Some(&empty), None, None), NOT_CONFIGURED);
    assert_eq!(vsj_paper(None), NULL);
    assert_eq!(vsj_configure(None, Some(&paper), None), NULL);
    for volts in [f64::NAN, 2001.0] {
        assert_eq!(vsj_from_volts(volts, Some(&mut 0)), OUT_OF_RANGE);
    }
}

#[test]
fn a_refused_setting_is_named_and_a_refused_configuration_is_none() {
    let (mut config, (letters, unit)) = (configured(&All::paper()), ([0; 32], [0; 64]));
    let mut error = Refused { field: letters, value: 0.0, lowest: 0.0, highest: 0.0, unit };
    let bad = All { full_scale_v: 20_000.0, ..All::paper() };
    assert_eq!(vsj_configure(Some(&mut config), Some(&bad), Some(&mut error)), OUT_OF_RANGE);
    let text = |letters: &[std::ffi::c_char]| -> String {
        letters.iter().take_while(|letter| **letter != 0).map(|letter| *letter as u8 as char).collect()
    };
    assert_eq!(
        (text(&error.field).as_str(), error.value, error.lowest, error.highest),
        ("full_scale_v", 2e4, 50.0, 1e3)
    );
    assert_eq!(text(&error.unit), "V");
    assert_eq!(vsj_start(Some(&config), Some(&mut StateSlot::default())), NOT_CONFIGURED);
    let mut line: Text = [0; 200];
    assert_eq!(vsj_explain(Some(&bad), Some(&mut line)), OUT_OF_RANGE);
    assert_eq!(text(&line), "full_scale_v = 20000 is not allowed: expected 50 to 1000 V");
}
