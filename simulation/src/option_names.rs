//! Errors of the libraries name a field; users know the option that sets it.

use crate::bad_input::BadInput;

/// Puts the option in front of an error that begins with a field's name. `options` holds pairs of field and option; a field
/// that ends in `.` stands for a whole table.
pub fn named(error: anyhow::Error, options: &[(&str, &str)]) -> anyhow::Error {
    let text = error.to_string();
    let field = text.split(' ').next().unwrap_or_default();
    let table = field.split_inclusive('.').next().unwrap_or_default();
    match options.iter().find(|(name, _)| *name == field || *name == table) {
        Some((_, option)) => BadInput(format!("{option}: {text}")).into(),
        None => error,
    }
}

/// The fields of [`model::Settings`] and the options of a controlled loop that set them.
pub const SETTINGS: &[(&str, &str)] = &[
    ("rate_hz", "--rate-hz"),
    ("full_scale_v", "--limit-v"),
    ("max_v", "--limit-v"),
    ("min_v", "--min-v"),
    ("slew_v_per_s", "--slew-v-per-s"),
    ("dac_bits", "--dac-bits"),
    ("proportional_gain", "--kp"),
    ("integral_gain_per_s", "--ki"),
    ("approach_s", "--approach-s"),
    ("margin.overshoot", "--overshoot-percent"),
    ("margin.fall_back", "--fall-back-percent"),
    ("margin.", "--known"),
    ("share", "--plant"),
    ("time_constant_s", "--plant"),
    ("relaxation.", "--plant"),
    ("memory.", "--plant"),
    ("law.", "--plant"),
    ("leakage.", "--plant"),
];
