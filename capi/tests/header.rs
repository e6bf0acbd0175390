//! `include/vsj_tick.h` says what the library has: functions, types, sizes and places of fields, constants.

use std::fmt::Write as _;
use std::mem::{offset_of, size_of};
use std::process::Command;

use vsj_tick::functions::{self, Refused, Text};
use vsj_tick::settings::{self, All, Known, Sensor, Spring};
use vsj_tick::slot::{CONFIG_BYTES, STATE_BYTES};
use vsj_tick::tick::{TickInput, TickOutput};

const HEADER: &str = include_str!("../include/vsj_tick.h");
const FUNCTIONS: &str = include_str!("../src/functions.rs");

/// Types of Rust and of C.
const TYPES: &[(&str, &str)] = &[
    ("Option<&mut All>", "vsj_settings *"),
    ("Option<&All>", "const vsj_settings *"),
    ("Option<&mut ConfigSlot>", "vsj_config *"),
    ("Option<&ConfigSlot>", "const vsj_config *"),
    ("Option<&mut StateSlot>", "vsj_state *"),
    ("Option<&mut Refused>", "vsj_error *"),
    ("Option<&TickInput>", "const vsj_input *"),
    ("Option<&mut TickOutput>", "vsj_output *"),
    ("Option<&mut i32>", "int32_t *"),
    ("Option<&mut Text>", "vsj_text *"),
    ("i32", "int32_t "),
    ("f64", "double "),
    ("Status", "vsj_status "),
];

fn in_c(rust: &str) -> &'static str {
    TYPES.iter().find(|(name, _)| *name == rust).unwrap_or_else(|| panic!("no type of C for {rust}")).1
}

#[test]
fn every_function_is_declared_with_its_arguments() {
    let declared: Vec<String> = HEADER
        .lines()
        .filter(|line| line.ends_with(';') && line.contains("(") && line.contains(" vsj_") && !line.starts_with(' '))
        .map(str::to_owned)
        .collect();
    let words: String = FUNCTIONS.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut expected = Vec::new();
    for function in words.split("fn vsj_").skip(1) {
        let (name, rest) = function.split_once('(').expect("arguments");
        let (arguments, rest) = rest.split_once(") -> ").expect("an answer");
        let answer = in_c(rest.split(' ').next().expect("a type"));
        let arguments = arguments.split(',').map(str::trim).filter(|argument| !argument.is_empty());
        let arguments: Vec<String> = arguments
            .map(|argument| {
                let (name, rust) = argument.split_once(": ").expect("a type");
                format!("{}{}", in_c(rust), if name == "line" { "text" } else { name })
            })
            .collect();
        expected.push(format!("{answer}vsj_{name}({});", arguments.join(", ")));
    }
    assert_eq!(declared, expected);
    assert!(declared.len() >= 10);
}

/// One assertion of C about a structure for each of its fields.
macro_rules! structure {
    ($text:ident, $c:literal, $rust:ident, $($field:ident),*) => {
        // A forgotten field is an error of the compiler.
        let _ = |$rust { $($field: _),* }: $rust| ();
        let _ = writeln!($text, "_Static_assert(sizeof({}) == {}, \"{}\");", $c, size_of::<$rust>(), $c);
        $(let _ = writeln!(
            $text,
            "_Static_assert(offsetof({c}, {field}) == {}, \"{c}.{field}\");",
            offset_of!($rust, $field),
            c = $c,
            field = stringify!($field),
        );)*
    };
}

#[test]
#[cfg(unix)]
fn structures_have_the_same_places_and_constants_the_same_values() {
    let mut text = String::from("#include <stddef.h>\n#include \"vsj_tick.h\"\n");
    structure!(
        text,
        "vsj_spring",
        Spring,
        share,
        tau_s,
        weights,
        tau_high_s,
        direct,
        thresholds_v,
        play_weights,
        law_voltage_v,
        law_stiffness,
        leakage_share,
        leakage_tau_s,
        lags,
        plays,
        points,
        reserved
    );
    structure!(
        text,
        "vsj_sensor",
        Sensor,
        noise_v,
        model_uncertainty,
        fastest_s,
        interval_s,
        oldest_s,
        lowest_v,
        highest_v,
        fade_s
    );
    structure!(
        text,
        "vsj_settings",
        All,
        rate_hz,
        full_scale_v,
        min_v,
        max_v,
        slew_v_per_s,
        kp,
        ki,
        approach_s,
        dac_bits,
        controller,
        spring,
        sensor,
        margin
    );
    structure!(text, "vsj_margin", Known, time_constant, share, gain, overshoot, fall_back);
    structure!(text, "vsj_error", Refused, field, value, lowest, highest, unit);
    structure!(text, "vsj_input", TickInput, target, reading, reading_age, has_reading);
    structure!(text, "vsj_output", TickOutput, target, voltage, applied, stiffness, code, limits, sensor);
    for (name, size) in [("vsj_config", CONFIG_BYTES), ("vsj_state", STATE_BYTES), ("vsj_text", size_of::<Text>())] {
        let _ = writeln!(text, "_Static_assert(sizeof({name}) == {size}, \"{name}\");");
    }
    let limits = [model::Limits::UPPER, model::Limits::LOWER, model::Limits::SLEW, model::Limits::TARGET];
    for (name, value) in [
        ("VSJ_OK", functions::OK as u32),
        ("VSJ_OUT_OF_RANGE", functions::OUT_OF_RANGE as u32),
        ("VSJ_NULL", functions::NULL as u32),
        ("VSJ_NOT_CONFIGURED", functions::NOT_CONFIGURED as u32),
        ("VSJ_NOT_STARTED", functions::NOT_STARTED as u32),
        ("VSJ_NONE", settings::NONE),
        ("VSJ_PAPER", settings::PAPER),
        ("VSJ_FAST", settings::FAST),
        ("VSJ_ROBUST", settings::ROBUST),
        ("VSJ_LIMIT_UPPER", u32::from(limits[0].bits())),
        ("VSJ_LIMIT_LOWER", u32::from(limits[1].bits())),
        ("VSJ_LIMIT_SLEW", u32::from(limits[2].bits())),
        ("VSJ_LIMIT_TARGET", u32::from(limits[3].bits())),
    ] {
        let _ = writeln!(text, "_Static_assert({name} == {value}, \"{name}\");");
    }
    let file = std::env::temp_dir().join(format!("vsj-header-{}.c", std::process::id()));
    std::fs::write(&file, text).expect("a file");
    let include = concat!(env!("CARGO_MANIFEST_DIR"), "/include");
    // The compiler that rustc links with.
    let done = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I", include])
        .arg(&file)
        .status();
    assert!(done.expect("cc starts").success(), "{}", file.display());
    let _ = std::fs::remove_file(&file);
}
