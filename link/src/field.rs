//! Numeric codes of the fields of a model or of settings that a validation can reject.

use core::fmt;

use serde::{Deserialize, Serialize};

/// Code of a field of a plant file or of a setting: the index of its name in the list of this module. Codes that this
/// version does not know are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Field(pub u8);

/// Names in the order of their codes. The order is part of the protocol: new names are appended.
const NAMES: [&str; 60] = [
    "memory.direct",
    "memory.thresholds_v",
    "memory.weights",
    "law.voltage_v",
    "law.stiffness",
    "leakage.share",
    "leakage.tau_s",
    "relaxation.share",
    "relaxation.tau_s",
    "relaxation.weights",
    "relaxation.tau_high_s",
    "share",
    "time_constant_s",
    "min_v",
    "max_v",
    "slew_v_per_s",
    "proportional_gain",
    "integral_gain_per_s",
    "controller",
    "sensor",
    "rate_hz",
    "full_scale_v",
    "approach_s",
    "noise_v",
    "model_uncertainty",
    "fastest_s",
    "interval_s",
    "oldest_s",
    "lowest_v",
    "highest_v",
    "fade_s",
    "host_timeout_s",
    "ramp_v_per_s",
    "missed_ticks_allowed",
    "forget_missed_s",
    "monitor_tolerance_v",
    "max_current_a",
    "monitor_time_s",
    "discharge_time_s",
    "hang_ms",
    "stall_ms",
    "reset_ms",
    "trip_on_cause",
    "range_v",
    "plant.time_constant_s",
    "margin.time_constant",
    "margin.share",
    "margin.gain",
    "margin.overshoot",
    "adaptation.enabled",
    "adaptation.time_constant",
    "adaptation.share",
    "adaptation.gain",
    "adaptation.rate_per_s",
    "adaptation.precision",
    "adaptation.excitation",
    "tolerance.time_constant",
    "tolerance.share",
    "tolerance.gain",
    "margin.fall_back",
];

impl Field {
    /// Code of a field without an entry in the list.
    pub const OTHER: Self = Self(u8::MAX);

    /// Code of the field that the validation calls `name`, [`Field::OTHER`] if the list does not contain it.
    pub fn named(name: &str) -> Self {
        NAMES.iter().position(|known| *known == name).map_or(Self::OTHER, |number| Self(number as u8))
    }

    /// Name that the validation uses, `another setting` for an unknown code.
    pub fn name(self) -> &'static str {
        NAMES.get(usize::from(self.0)).unwrap_or(&"another setting")
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
