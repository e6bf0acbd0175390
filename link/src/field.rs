//! Which field of a model was refused.

use core::fmt;

use serde::{Deserialize, Serialize};

/// A field of a plant file or a setting, by its number: an older host can show what a newer MCU says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Field(pub u8);

/// In the order of their numbers; new ones go to the end.
const NAMES: [&str; 18] = [
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
];

impl Field {
    /// One that has no number.
    pub const OTHER: Self = Self(u8::MAX);

    /// The field of that name.
    pub fn named(name: &str) -> Self {
        NAMES.iter().position(|known| *known == name).map_or(Self::OTHER, |number| Self(number as u8))
    }

    /// As the model's check names it.
    pub fn name(self) -> &'static str {
        NAMES.get(usize::from(self.0)).unwrap_or(&"another setting")
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
