//! Codes of what went wrong in the MCU.

use core::fmt;

use model::supervisor;
use serde::{Deserialize, Serialize};

/// Why the MCU took the voltage away: [`supervisor::Fault`] by its number, so that an older host can show what a newer MCU
/// says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault(pub u8);

impl Fault {
    /// No fault.
    pub const NONE: Self = Self(0);

    /// The fault of a state.
    pub fn of(state: supervisor::State) -> Self {
        match state {
            supervisor::State::Faulted(fault) => fault.into(),
            supervisor::State::Disarmed | supervisor::State::Armed => Self::NONE,
        }
    }

    /// One word for tables and JSON.
    pub fn name(self) -> &'static str {
        match supervisor::Fault::from_code(self.0) {
            Some(fault) => fault.name(),
            None if self == Self::NONE => "none",
            None => "unknown",
        }
    }
}

impl From<supervisor::Fault> for Fault {
    fn from(fault: supervisor::Fault) -> Self {
        Self(fault.code())
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name(), self.0)
    }
}
