//! Numeric codes of the MCU's faults.

use core::fmt;

use model::supervisor;
use serde::{Deserialize, Serialize};

/// Fault because of which the MCU switched the voltage off: the code of a [`supervisor::Fault`], or 0 for none. Codes that
/// this version does not know are kept, so that an older host can display the faults of a newer MCU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault(pub u8);

impl Fault {
    /// No fault.
    pub const NONE: Self = Self(0);

    /// Fault of the supervisor's `state`, [`Fault::NONE`] unless it is faulted.
    pub fn of(state: supervisor::State) -> Self {
        match state {
            supervisor::State::Faulted(fault) => fault.into(),
            supervisor::State::Disarmed | supervisor::State::Armed => Self::NONE,
        }
    }

    /// Name for tables and JSON; `unknown` for a code that this version does not know.
    pub fn name(self) -> &'static str {
        match supervisor::Fault::from_code(self.0) {
            Some(fault) => fault.name(),
            None if self == Self::NONE => "none",
            None => "unknown",
        }
    }

    /// What a person does about the fault before it is acknowledged; `None` without one and for an unknown code.
    pub fn remedy(self) -> Option<&'static str> {
        supervisor::Fault::from_code(self.0).map(supervisor::Fault::remedy)
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
