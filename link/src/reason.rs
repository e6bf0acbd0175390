//! Why the MCU rejects a request.

use core::fmt;

use model::OutOfRange;
use serde::{Deserialize, Serialize};

use crate::fault::Fault;
use crate::field::Field;

/// Why a request was rejected. A rejected request has no effect at all.
///
/// The order of the variants defines their codes on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reason {
    /// The desired stiffness requires a static voltage outside of the amplifier's range. The bounds are in the unit of the
    /// request.
    OutOfRange {
        /// Lowest stiffness within the range.
        lowest: f64,
        /// Highest stiffness within the range.
        highest: f64,
    },
    /// The request requires the armed state.
    NotArmed,
    /// The given fault must be acknowledged first.
    Faulted(Fault),
    /// The frame is of another protocol version than the MCU's, which is given here.
    BadVersion(u8),
    /// The MCU has received no `Hello` since its start; it may have restarted during the session.
    HelloFirst,
    /// The sequence number is older than that of an accepted request, or the session has used up all numbers.
    Stale {
        /// The newest accepted sequence number.
        newest: u16,
    },
    /// A different request with the same sequence number was accepted before.
    SequenceReused,
    /// The CRC is correct, but the message does not exist in this protocol version.
    UnknownRequest,
    /// The interlock is open.
    InterlockOpen,
    /// The fault to be acknowledged differs from the present one, which is given here.
    OtherFault(Fault),
    /// The host's silence exceeded the limit when the request to arm was executed.
    HostSilent,
    /// The request requires the disarmed state.
    Armed,
    /// Parts of the model or of the settings are missing; the number of the next expected part is given.
    PartMissing(u8),
    /// The checksum of the model or of the settings is wrong, or the format of the payload is unknown.
    Damaged,
    /// The model failed its validation.
    BadModel {
        /// Field that is out of bounds.
        field: Field,
        /// Lowest permitted value.
        lowest: f64,
        /// Highest permitted value.
        highest: f64,
    },
    /// The flash could not be written; what was stored before remains valid.
    NotStored,
    /// The monitors show a voltage or a current although the amplifier is switched off.
    Live,
    /// The cause of the fault to be acknowledged is still there.
    CausePresent(Fault),
    /// The request is of another session than the MCU's: a frame from earlier, or a second program.
    OtherSession,
    /// The supply of the converters is out of its range.
    Reference,
    /// The settings failed their validation.
    BadSettings {
        /// Field that is out of bounds.
        field: Field,
        /// Lowest permitted value.
        lowest: f64,
        /// Highest permitted value.
        highest: f64,
    },
    /// The given setting asks for a part of the program that the image does not contain.
    NotBuiltIn(Field),
    /// The MCU's RAM has no room for the rows of the capture.
    TooManyRows {
        /// Number of rows that fit.
        most: u32,
    },
}

impl Reason {
    /// Code of the reason on the wire; it never changes.
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
            Self::Damaged => 13,
            Self::BadModel { .. } => 14,
            Self::NotStored => 15,
            Self::Live => 16,
            Self::CausePresent(_) => 17,
            Self::OtherSession => 18,
            Self::Reference => 19,
            Self::BadSettings { .. } => 20,
            Self::NotBuiltIn(_) => 21,
            Self::TooManyRows { .. } => 22,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { lowest, highest } => write!(f, "out of range: expected {lowest} to {highest}"),
            Self::NotArmed => f.write_str("not armed"),
            Self::Faulted(fault) => write!(f, "faulted: {fault}; acknowledge it first"),
            Self::BadVersion(version) => {
                write!(f, "the MCU speaks version {version} of the protocol, this program {}", crate::VERSION)
            }
            Self::HelloFirst => f.write_str("the MCU has restarted and waits for a Hello"),
            Self::Stale { newest } => write!(f, "too late: request {newest} is already accepted"),
            Self::SequenceReused => f.write_str("a different request has the same sequence number"),
            Self::UnknownRequest => f.write_str("the MCU does not know this request"),
            Self::InterlockOpen => f.write_str("the interlock is open"),
            Self::OtherFault(fault) => write!(f, "a different fault is present: {fault}"),
            Self::HostSilent => f.write_str("the host was silent for too long"),
            Self::Armed => f.write_str("armed; disarm it first"),
            Self::PartMissing(expected) => write!(f, "a part is missing; expected part {expected}"),
            Self::Damaged => f.write_str("it arrived damaged, or the MCU does not know its format"),
            Self::BadModel { field, lowest, highest } => {
                write!(f, "the model cannot be run: {field} has to lie within {lowest} to {highest}")
            }
            Self::NotStored => f.write_str("the flash could not be written; what it held before stays"),
            Self::Live => f.write_str("the amplifier is off, and its monitors still show a voltage or a current"),
            Self::CausePresent(fault) => write!(f, "the cause of the fault is still there: {fault}"),
            Self::OtherSession => f.write_str("the MCU is in a session with another program"),
            Self::Reference => f.write_str("the supply of the MCU's converters is out of its range"),
            Self::BadSettings { field, lowest, highest } => {
                write!(f, "the settings cannot be run: {field} has to lie within {lowest} to {highest}")
            }
            Self::NotBuiltIn(field) => {
                write!(f, "the MCU's image is built without it: {field}; flash an image that has it")
            }
            Self::TooManyRows { most } => write!(f, "the MCU's RAM has room for {most} rows of a capture"),
        }
    }
}

impl Reason {
    /// The reason that reports an error of the model's validation.
    pub fn of_model(error: &OutOfRange) -> Self {
        Self::BadModel { field: Field::named(error.field), lowest: error.lowest, highest: error.highest }
    }

    /// The reason that reports an error of the settings' validation.
    pub fn of_settings(error: &OutOfRange) -> Self {
        Self::BadSettings { field: Field::named(error.field), lowest: error.lowest, highest: error.highest }
    }
}

impl From<OutOfRange> for Reason {
    fn from(error: OutOfRange) -> Self {
        Self::OutOfRange { lowest: error.lowest, highest: error.highest }
    }
}
