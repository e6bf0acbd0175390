//! Numeric codes of what disagrees: the amplifier's monitors, and the stiffness sensor. Codes that this version does not
//! know are kept.

use model::supervisor;
use serde::{Deserialize, Serialize};

/// What disagrees with the output: the code of a [`supervisor::Mismatch`], or 0 for nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Mismatch(pub u8);

impl Mismatch {
    /// Name for tables and JSON; `unknown` for a code that this version does not know.
    pub fn name(self) -> &'static str {
        match supervisor::Mismatch::ALL.into_iter().find(|mismatch| mismatch.code() == self.0) {
            Some(mismatch) => mismatch.name(),
            None if self.0 == 0 => "none",
            None => "unknown",
        }
    }
}

impl From<Option<supervisor::Mismatch>> for Mismatch {
    fn from(mismatch: Option<supervisor::Mismatch>) -> Self {
        Self(mismatch.map_or(0, supervisor::Mismatch::code))
    }
}

/// Diagnosis of the stiffness sensor: the code of a [`model::Sensor`], or 0 without a sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sensor(pub u8);

impl Sensor {
    /// Name for tables and JSON; `unknown` for a code that this version does not know.
    pub fn name(self) -> &'static str {
        model::SENSOR_NAMES.get(usize::from(self.0)).unwrap_or(&"unknown")
    }
}

impl From<Option<model::Sensor>> for Sensor {
    fn from(sensor: Option<model::Sensor>) -> Self {
        Self(sensor.map_or(0, model::Sensor::code))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_stable_and_have_names() {
        let names = |name: fn(u8) -> &'static str| (0..9).map(name).collect::<std::vec::Vec<_>>().join(" ");
        assert_eq!(names(|code| Mismatch(code).name()), "none limit open short leakage reference held slew unknown");
        let sensor = "none trusted absent stale stuck jumping out-of-range unknown unknown";
        assert_eq!(names(|code| Sensor(code).name()), sensor);
        assert_eq!(Mismatch::from(Some(supervisor::Mismatch::Short)), Mismatch(3));
        assert_eq!((Mismatch::from(None), Sensor::from(None)), (Mismatch(0), Sensor(0)));
    }
}
