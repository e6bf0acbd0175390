//! What the voltage does between the rows of a record.

use std::str::FromStr;

use anyhow::Result;
use simulation::bad_input::BadInput;
use simulation::record::Record;
use simulation::schedule::Schedule;

/// Tolerance in s within which a row of the stair may have the voltage before or after a step: the duration of its ramps.
const RAMP_S: f64 = 0.1;

/// Voltage between two rows of the record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Input {
    /// The voltage stays at the value of the earlier row.
    #[default]
    Hold,
    /// The voltage is linear between the rows.
    Linear,
    /// The voltage is the report's stair with its ramps of 0.1 s.
    Stair,
}

impl FromStr for Input {
    type Err = BadInput;

    fn from_str(name: &str) -> Result<Self, BadInput> {
        match name {
            "hold" => Ok(Self::Hold),
            "linear" => Ok(Self::Linear),
            "stair" => Ok(Self::Stair),
            _ => Err(BadInput(format!("input = {name:?}; expected hold, linear or stair"))),
        }
    }
}

impl Input {
    /// Checks that a record has the voltages of the stair, if this says that it was recorded under it.
    ///
    /// # Errors
    /// [`BadInput`] with the first row that has another voltage.
    pub fn check(self, record: &Record) -> Result<()> {
        match self {
            Self::Hold | Self::Linear => Ok(()),
            Self::Stair => Schedule::stair().check_commanded("the report's stair (--input stair)", record, RAMP_S),
        }
    }
}
