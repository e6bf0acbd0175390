//! Names, remedies and codes: what a host shows is what the MCU's code stands for.

use link::{Controller, Fault, Field, Sensor, State};
use model::amplifier::Limits;
use model::supervisor::{self, Command, Inputs, Settings, Supervisor};
use model::{Approach, Compensation, DacCode, Gains, Margin, Output, SampleTime, Volts};

#[test]
fn a_fault_has_the_name_and_the_remedy_of_the_supervisor() {
    for fault in supervisor::Fault::ALL {
        let code = Fault::from(fault);
        assert_eq!((code.name(), code.remedy()), (fault.name(), Some(fault.remedy())));
    }
    for (code, name) in [(0, "none"), (200, "unknown")] {
        assert_eq!((Fault(code).name(), Fault(code).remedy()), (name, None));
    }
}

#[test]
fn a_field_keeps_its_name_across_the_link() {
    for name in ["memory.direct", "leakage.share", "integral_gain_per_s", "controller", "reset_ms", "margin.fall_back"]
    {
        assert_eq!(Field::named(name).name(), name);
    }
    for unknown in [Field::named("no such field"), Field(60)] {
        assert_eq!(unknown.name(), "another setting");
    }
    assert_eq!(Field::named("no such field"), Field::OTHER);
}

/// The client in C++ has the names in the order of their codes.
#[test]
fn a_field_has_the_same_name_in_the_header_for_cpp() {
    let header = include_str!("../../clients/cpp/vsj_link.hpp");
    let (_, list) = header.split_once("field_name(std::uint8_t code) {").unwrap();
    let (list, _) = list.split_once("};").unwrap();
    let listed: Vec<&str> = list.split('"').skip(1).step_by(2).collect();
    let names: Vec<&str> =
        (0..=u8::MAX).map(|code| Field(code).name()).take_while(|name| *name != "another setting").collect();
    assert_eq!(listed, names);
}

/// So it has the format of a model, its longest payload and the bytes in a part.
#[test]
fn the_header_for_cpp_sends_models_in_the_same_parts() {
    use link::wire_model::{FORMAT, MOST_BYTES};
    let header = include_str!("../../clients/cpp/vsj_link.hpp");
    let parts = format!("most_model_bytes = {MOST_BYTES}, part_bytes = {};", link::block::PART);
    assert!(header.contains(&parts) && header.contains(&format!("model_format = {FORMAT};")), "{parts}");
}

/// A field without a code would be refused as `another setting`.
#[test]
fn every_field_of_the_settings_that_a_check_can_name_has_a_code() {
    let settings = include_str!("../../model/src/device.rs");
    let others = [
        include_str!("../../model/src/adaptation/mod.rs"),
        include_str!("../../model/src/amplifier.rs"),
        include_str!("../../model/src/pre_compensator.rs"),
        include_str!("../../model/src/time_optimal/enabled/mod.rs"),
        include_str!("../../model/src/robust/enabled.rs"),
        include_str!("../../model/src/feedback/enabled/settings.rs"),
        include_str!("../../model/src/supervisor/settings.rs"),
    ];
    let named =
        |source: &'static str| source.split("OutOfRange::check(\"").skip(1).filter_map(|rest| rest.split('"').next());
    let listed =
        settings.split("(\"").skip(1).filter_map(|rest| rest.split('"').next()).filter(|name| name.ends_with("_ms"));
    let names: Vec<&str> = others.into_iter().chain([settings]).flat_map(named).chain(listed).collect();
    assert!(names.len() >= 35, "{names:?}");
    // What is the board's own cannot be sent.
    let fixed = ["dac_bits", "lowest_supply_v", "highest_supply_v"];
    for name in names.iter().filter(|name| !fixed.contains(name)) {
        assert_eq!(Field::named(name).name(), *name);
    }
}

#[test]
fn every_diagnosis_of_the_sensor_has_its_own_code() {
    use model::feedback::Fault::{Absent, Jumping, OutOfRange, Stale, Stuck};
    let faults = [Absent, Stale, Stuck, Jumping, OutOfRange].map(model::Sensor::Failed);
    let all = [model::Sensor::Trusted].into_iter().chain(faults);
    let names: Vec<&str> = all.map(|sensor| Sensor::from(Some(sensor)).name()).collect();
    assert_eq!(names, ["trusted", "absent", "stale", "stuck", "jumping", "out-of-range"]);
}

#[test]
fn controllers_are_called_as_on_the_command_line() {
    let gains = Gains { proportional: 1.0, integral_per_s: 1.0 };
    for (compensation, name) in [
        (Compensation::None, "none"),
        (Compensation::ProportionalIntegral(gains), "paper"),
        (Compensation::TimeOptimal(Approach { time_constant_s: 0.1 }), "fast"),
        (
            Compensation::Robust(Margin {
                time_constant: 0.1,
                share: 0.1,
                gain: 0.1,
                overshoot: 0.02,
                ..Margin::TYPICAL
            }),
            "robust",
        ),
    ] {
        assert_eq!(Controller::of(&compensation).name(), name);
    }
}

/// A supervisor that disarms, arms, is left alone by its host and meets a fault, as the link shows it.
#[test]
fn the_state_on_the_link_is_that_of_the_supervisor() {
    let config = Settings::DEFAULT.validate(SampleTime::from_rate(1000.0).unwrap()).unwrap().quantize();
    let mut supervisor = Supervisor::new(config, None);
    let mut shown = |inputs: Inputs| {
        supervisor.decide(&inputs);
        let voltage = Volts::new(300.0).unwrap();
        supervisor.release(&Output {
            target: voltage,
            voltage,
            code: DacCode(1755),
            applied: voltage,
            stiffness: model::ScaledStiffness::default(),
            limits: Limits::NONE,
            sensor: None,
        });
        State::from(&supervisor).name()
    };
    let target = Volts::new(300.0).unwrap();
    let calm = Inputs { ticks_since_host: 0, interlock_closed: true, target, ..Inputs::default() };
    assert_eq!(shown(calm), "disarmed");
    assert_eq!(shown(Inputs { command: Some(Command::Arm), ..calm }), "armed");
    assert_eq!(shown(calm), "armed");
    assert_eq!(shown(Inputs { ticks_since_host: 501, ..calm }), "ramping");
    assert_eq!(shown(calm), "armed");
    assert_eq!(shown(Inputs { interlock_closed: false, ..calm }), "faulted");
}
