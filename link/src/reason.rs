//! Why the MCU refuses.

use core::fmt;

use model::OutOfRange;
use serde::{Deserialize, Serialize};

use crate::fault::Fault;
use crate::field::Field;

/// Why a request was not applied. Half of it never is.
///
/// The order of the variants is their code on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reason {
    /// Static voltage beyond the amplifier's range; the range in the unit of the request.
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
    /// The amplifier holds a voltage, or a current flows, although it is off.
    Live,
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
            Self::Live => 16,
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
            Self::Live => f.write_str("the amplifier is off, and its monitors still show a voltage or a current"),
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
