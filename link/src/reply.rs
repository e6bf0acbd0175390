//! What the MCU answers.

use core::fmt;

use model::Compensation;
use model::supervisor::{self, Supervisor};
use serde::{Deserialize, Serialize};

use crate::fault::Fault;
use crate::reason::Reason;
use crate::session::Counters;
use crate::value::WireVolts;
use crate::wire_model::ModelId;

/// A reply. It carries the sequence number of its request; telemetry, which nobody waits for, counts its own.
///
/// The order of the variants is their code on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// Done.
    Ack {
        /// The state afterwards.
        state: State,
        /// The target afterwards.
        target: WireVolts,
    },
    /// Not done, and nothing has changed.
    Refused(Reason),
    /// Everything about the MCU.
    Status(Status),
    /// One sample of the loop.
    Telemetry(Telemetry),
    /// What runs, and what will.
    Model(Models),
}

/// The models of an MCU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Models {
    /// The one that runs.
    pub active: ModelId,
    /// The one that the next start will find.
    pub stored: ModelId,
}

/// Whether voltage may leave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum State {
    /// No voltage, output disabled; waits to be armed.
    #[default]
    Disarmed,
    /// The loop follows the target.
    Armed,
    /// Armed, but the host is silent: the target falls to zero, then the MCU disarms. A sign of life ends it.
    Ramping,
    /// No voltage, output disabled; the fault must be acknowledged first.
    Faulted,
}

/// The whole state of the MCU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// What was built in.
    pub firmware: Firmware,
    /// Ticks per second, in Hz.
    pub rate_hz: u32,
    /// Ticks of host silence until the MCU acts on it.
    pub silence_limit_ticks: u32,
    /// Lowest scaled stiffness that may be asked for: the amplifier's range, whatever the spring.
    pub lowest: WireVolts,
    /// Highest scaled stiffness that may be asked for.
    pub highest: WireVolts,
    /// Late ticks since the start.
    pub overruns: u32,
    /// The fault that is present or, if none is, [`Fault::NONE`].
    pub fault: Fault,
    /// The fault that caused the last reset.
    pub last_fault: Fault,
    /// The loop's latest sample.
    pub sample: Telemetry,
    /// What came over the link.
    pub counters: Counters,
}

/// Which program runs on the MCU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Firmware {
    /// Major version.
    pub major: u8,
    /// Minor version.
    pub minor: u8,
    /// Patch version.
    pub patch: u8,
    /// First eight hexadecimal digits of the git revision; 0 if it is not known.
    pub revision: u32,
    /// Who leads the spring.
    pub controller: Controller,
}

/// Which pre-compensator leads the spring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Controller {
    /// None.
    #[default]
    None,
    /// The paper's.
    Paper,
    /// The time-optimal one.
    Fast,
}

impl Controller {
    /// Of these settings.
    pub const fn of(compensation: &Compensation) -> Self {
        match compensation {
            Compensation::None => Self::None,
            Compensation::ProportionalIntegral(_) => Self::Paper,
            Compensation::TimeOptimal(_) => Self::Fast,
        }
    }

    /// As `vsj` has it on its command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Paper => "paper",
            Self::Fast => "fast",
        }
    }
}

/// One sample of the loop: all of the same tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Number of the tick since the start.
    pub tick: u64,
    /// Whether voltage may leave.
    pub state: State,
    /// The target that is pursued.
    pub target: WireVolts,
    /// The voltage that `code` stands for.
    pub applied: WireVolts,
    /// The estimator's scaled stiffness.
    pub estimate: WireVolts,
    /// The sensor's scaled stiffness, where there is one.
    pub measured: Option<WireVolts>,
    /// What the DAC was told, 0 to 65 535.
    pub code: u16,
    /// Limits that acted, as [`model::Limits::bits`]: upper 1, lower 2, slew 4, target 8.
    pub limits: u8,
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
    /// One word for tables and JSON.
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
