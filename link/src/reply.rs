//! What the MCU answers.

use core::fmt;

use model::supervisor::{self, Supervisor};
use model::{Compensation, OutOfRange};
use serde::{Deserialize, Serialize};

use crate::fault::Fault;
use crate::field::Field;
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

/// Why a request was not applied. Half of it never is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reason {
    /// The spring cannot reach this stiffness; what it can, in the unit of the request.
    OutOfRange {
        /// Lowest reachable stiffness.
        lowest: f64,
        /// Highest reachable stiffness.
        highest: f64,
    },
    /// Only an armed MCU does this.
    NotArmed,
    /// A fault has to be acknowledged first.
    Faulted(Fault),
    /// The frame is of another protocol version; this is the MCU's.
    BadVersion(u8),
    /// The MCU has not been greeted since it started: it may have restarted.
    HelloFirst,
    /// The frame is older than one that was accepted.
    Stale {
        /// The newest accepted sequence number.
        newest: u16,
    },
    /// A different request came before with this same sequence number.
    SequenceReused,
    /// The frame is sound, its message is none of this version's.
    UnknownRequest,
    /// The interlock is open.
    InterlockOpen,
    /// The fault to be acknowledged is not the one that is present.
    OtherFault(Fault),
    /// The host had been silent for too long when it armed.
    HostSilent,
    /// Only a disarmed MCU does this.
    Armed,
    /// Parts of the model are missing; the one that is expected next.
    PartMissing(u8),
    /// The model's checksum is wrong, or its payload is none of this version's.
    ModelDamaged,
    /// The model was checked and cannot be run.
    BadModel {
        /// What is wrong with it.
        field: Field,
        /// Lowest value allowed.
        lowest: f64,
        /// Highest value allowed.
        highest: f64,
    },
    /// The memory did not take the model; the old one stays.
    NotStored,
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
    /// Lowest scaled stiffness in reach.
    pub lowest: WireVolts,
    /// Highest scaled stiffness in reach.
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

impl Reason {
    /// Stable code, as on the wire.
    pub const fn code(&self) -> u8 {
        match self {
            Self::OutOfRange { .. } => 0,
            Self::NotArmed => 1,
            Self::Faulted(_) => 2,
            Self::BadVersion(_) => 3,
            Self::HelloFirst => 4,
            Self::Stale { .. } => 5,
            Self::SequenceReused => 6,
            Self::UnknownRequest => 7,
            Self::InterlockOpen => 8,
            Self::OtherFault(_) => 9,
            Self::HostSilent => 10,
            Self::Armed => 11,
            Self::PartMissing(_) => 12,
            Self::ModelDamaged => 13,
            Self::BadModel { .. } => 14,
            Self::NotStored => 15,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { lowest, highest } => write!(f, "out of reach: expected {lowest} to {highest}"),
            Self::NotArmed => f.write_str("not armed"),
            Self::Faulted(fault) => write!(f, "faulted: {fault}; acknowledge it first"),
            Self::BadVersion(version) => {
                write!(f, "the MCU speaks version {version} of the protocol, this program {}", crate::VERSION)
            }
            Self::HelloFirst => f.write_str("the MCU has restarted and waits for a Hello"),
            Self::Stale { newest } => write!(f, "came too late: request {newest} was already accepted"),
            Self::SequenceReused => f.write_str("another request had the same sequence number"),
            Self::UnknownRequest => f.write_str("the MCU does not know this request"),
            Self::InterlockOpen => f.write_str("the interlock is open"),
            Self::OtherFault(fault) => write!(f, "the fault is another one: {fault}"),
            Self::HostSilent => f.write_str("the host had been silent for too long"),
            Self::Armed => f.write_str("armed; disarm it first"),
            Self::PartMissing(expected) => write!(f, "a part of the model is missing; part {expected} was expected"),
            Self::ModelDamaged => f.write_str("the model arrived damaged, or the MCU does not know its format"),
            Self::BadModel { field, lowest, highest } => {
                write!(f, "the model cannot be run: {field} has to lie within {lowest} to {highest}")
            }
            Self::NotStored => f.write_str("the memory did not take the model; the old one stays"),
        }
    }
}

impl Reason {
    /// What the model's own check says of a model.
    pub fn of_model(error: &OutOfRange) -> Self {
        Self::BadModel { field: Field::named(error.field), lowest: error.lowest, highest: error.highest }
    }
}

impl From<OutOfRange> for Reason {
    fn from(error: OutOfRange) -> Self {
        Self::OutOfRange { lowest: error.lowest, highest: error.highest }
    }
}
