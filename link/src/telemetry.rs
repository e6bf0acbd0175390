//! One sample of the control loop, and the state of the output.

use core::fmt;

use model::supervisor::{self, Supervisor};
use serde::{Deserialize, Serialize};

use crate::diagnosis::{Mismatch, Sensor};
use crate::value::WireVolts;

/// State of the output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum State {
    /// 0 V, output disabled; can be armed.
    #[default]
    Disarmed,
    /// The output is enabled and the controller follows the target.
    Armed,
    /// Armed, but the host is silent: the target ramps down to 0 V, then the MCU disarms. An accepted frame ends the ramp.
    Ramping,
    /// 0 V, output disabled; the fault must be acknowledged first.
    Faulted,
}

/// One sample of the control loop; all values are of the same tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Number of the tick, counted from the start.
    pub tick: u64,
    /// State of the output.
    pub state: State,
    /// Target after limitation and ramping, as equivalent static voltage.
    pub target: WireVolts,
    /// Voltage that corresponds to `code`.
    pub applied: WireVolts,
    /// Estimated stiffness, as equivalent static voltage.
    pub estimate: WireVolts,
    /// Measured stiffness, as equivalent static voltage; `None` without a new reading.
    pub measured: Option<WireVolts>,
    /// Code written to the DAC, 0 to 65 535.
    pub code: u16,
    /// Active limits as [`model::Limits::bits`]: upper 1, lower 2, slew 4, target 8.
    pub limits: u8,
    /// What disagrees with the output; of a monitor fault, what it was found by.
    pub mismatch: Mismatch,
    /// Diagnosis of the stiffness sensor.
    pub sensor: Sensor,
}

impl From<&Supervisor> for State {
    fn from(supervisor: &Supervisor) -> Self {
        match supervisor.state() {
            supervisor::State::Disarmed => Self::Disarmed,
            supervisor::State::Armed if supervisor.ramping() => Self::Ramping,
            supervisor::State::Armed => Self::Armed,
            supervisor::State::Faulted(_) => Self::Faulted,
        }
    }
}

impl State {
    /// Name for tables and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Disarmed => "disarmed",
            Self::Armed => "armed",
            Self::Ramping => "ramping",
            Self::Faulted => "faulted",
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
