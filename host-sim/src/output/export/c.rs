//! Files of `vsj export c`.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use model::{ExtendedPlant, Settings};
use serde::Serialize;
use simulation::bad_input::one_line;
use vsj_tick::settings::{All, FAST, Known, NONE, PAPER, ROBUST, Sensor, Spring};

use crate::output::files::Files;

/// Header of the library, which fits it as the settings do.
const HEADER: &str = include_str!("../../../../capi/include/vsj_tick.h");
/// The example, which its user changes.
const EXAMPLE: [(&str, &str); 7] = [
    ("main.c", include_str!("../../../../capi/example/main.c")),
    ("CMakeLists.txt", include_str!("../../../../capi/example/CMakeLists.txt")),
    ("arm-none-eabi.cmake", include_str!("../../../../capi/example/arm-none-eabi.cmake")),
    ("mps2-an386.c", include_str!("../../../../capi/example/mps2-an386.c")),
    ("mps2-an386.ld", include_str!("../../../../capi/example/mps2-an386.ld")),
    ("semihosting.c", include_str!("../../../../capi/example/semihosting.c")),
    ("semihosting.h", include_str!("../../../../capi/example/semihosting.h")),
];

/// The answer of `vsj export c --json`.
#[derive(Debug, Serialize)]
pub struct Answer {
    schema: u32,
    files: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    kept: Vec<String>,
    tick_s: f64,
    not_simulated: Vec<String>,
}

impl Answer {
    /// The answer about files that were written, and others that were kept.
    pub fn new(paths: &[PathBuf], kept: &[&str], rate_hz: f64, not_simulated: Vec<String>) -> Self {
        let files = paths.iter().filter_map(|path| path.file_name());
        let files = files.map(|name| name.to_string_lossy().into_owned()).collect();
        let kept = kept.iter().map(|name| (*name).to_owned()).collect();
        Self { schema: 1, files, kept, tick_s: 1.0 / rate_hz, not_simulated }
    }
}

/// Adds the settings of a spring, called `name`, and the example; returns the names of its files that are kept because they were changed.
///
/// # Errors
/// If a file cannot be written.
pub fn write(
    settings: &Settings<ExtendedPlant<'_>>,
    name: &str,
    not_simulated: &[String],
    files: &mut Files,
) -> Result<Vec<&'static str>> {
    let header = header(&All::new(settings), name, not_simulated);
    files.add("vsj_settings.h", |out| out.write_all(header.as_bytes()))?;
    files.add("vsj_tick.h", |out| out.write_all(HEADER.as_bytes()))?;
    let mut kept = Vec::new();
    for (name, text) in EXAMPLE {
        if files.add_unless_changed(name, text)? {
            kept.push(name);
        }
    }
    Ok(kept)
}

/// The settings as the constant `VSJ_SETTINGS`. Each number is read back to the bit.
fn header(all: &All, name: &str, not_simulated: &[String]) -> String {
    let All {
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
        margin,
    } = all;
    // No text of a file ends a comment.
    let commented = |text: &str| one_line(text).replace("*/", "* /");
    let mut text = format!("/* Settings of the controller for the spring {}", commented(name));
    if !not_simulated.is_empty() {
        let _ = write!(text, "; not simulated: {}", commented(&not_simulated.join(", ")));
    }
    text += ". Written by `vsj export c`. */\n#ifndef VSJ_SETTINGS_H\n#define VSJ_SETTINGS_H\n\n#include \"vsj_tick.h\"\n\n";
    text += "static const vsj_settings VSJ_SETTINGS = {\n";
    let mut number = |key: &str, value: &f64| {
        let _ = writeln!(text, "    .{key} = {value:?},");
    };
    number("rate_hz", rate_hz);
    number("full_scale_v", full_scale_v);
    number("min_v", min_v);
    number("max_v", max_v);
    number("slew_v_per_s", slew_v_per_s);
    number("kp", kp);
    number("ki", ki);
    number("approach_s", approach_s);
    let controller = match *controller {
        NONE => "VSJ_NONE".to_owned(),
        PAPER => "VSJ_PAPER".to_owned(),
        FAST => "VSJ_FAST".to_owned(),
        ROBUST => "VSJ_ROBUST".to_owned(),
        other => other.to_string(),
    };
    let _ = write!(text, "    .dac_bits = {dac_bits},\n    .controller = {controller},\n");
    text += &spring_text(spring);
    text += &sensor_text(sensor);
    text += &margin_text(margin);
    text + "};\n\n#endif\n"
}

fn spring_text(spring: &Spring) -> String {
    let Spring {
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
        reserved: _,
    } = spring;
    let list = |values: &[f64], count: &u32| {
        let values = values.iter().take((*count).max(1) as usize);
        let texts: Vec<String> = values.map(|value| format!("{value:?}")).collect();
        format!("{{{}}}", texts.join(", "))
    };
    let entries = [
        ("share", format!("{share:?}")),
        ("tau_s", list(tau_s, lags)),
        ("weights", list(weights, lags)),
        ("tau_high_s", format!("{tau_high_s:?}")),
        ("direct", format!("{direct:?}")),
        ("thresholds_v", list(thresholds_v, plays)),
        ("play_weights", list(play_weights, plays)),
        ("law_voltage_v", list(law_voltage_v, points)),
        ("law_stiffness", list(law_stiffness, points)),
        ("leakage_share", format!("{leakage_share:?}")),
        ("leakage_tau_s", format!("{leakage_tau_s:?}")),
        ("lags", lags.to_string()),
        ("plays", plays.to_string()),
        ("points", points.to_string()),
    ];
    let lines: String = entries.iter().map(|(key, value)| format!("        .{key} = {value},\n")).collect();
    format!("    .spring = {{\n{lines}    }},\n")
}

fn sensor_text(sensor: &Sensor) -> String {
    let Sensor { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s } = sensor;
    let entries = [
        ("noise_v", noise_v),
        ("model_uncertainty", model_uncertainty),
        ("fastest_s", fastest_s),
        ("interval_s", interval_s),
        ("oldest_s", oldest_s),
        ("lowest_v", lowest_v),
        ("highest_v", highest_v),
        ("fade_s", fade_s),
    ];
    part("sensor", &entries)
}

fn margin_text(margin: &Known) -> String {
    let Known { time_constant, share, gain, overshoot, fall_back } = margin;
    let known = [("time_constant", time_constant), ("share", share), ("gain", gain)];
    let entries = [&known[..], &[("overshoot", overshoot), ("fall_back", fall_back)]].concat();
    part("margin", &entries)
}

/// A structure of numbers.
fn part(name: &str, entries: &[(&str, &f64)]) -> String {
    let lines: String = entries.iter().map(|(key, value)| format!("        .{key} = {value:?},\n")).collect();
    format!("    .{name} = {{\n{lines}    }},\n")
}

/// The answer for a terminal.
pub fn text(answer: &Answer) -> String {
    format!("tick {} s; the library: cargo build --release -p capi\n", answer.tick_s)
}
