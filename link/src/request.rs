//! Requests of the host.

use serde::{Deserialize, Serialize};

use crate::adaptation::Adaptation;
use crate::block::{Block, PART, Part};
use crate::capture::Capture;
use crate::checksum::checksum;
use crate::fault::Fault;
use crate::isolation::Isolation;
use crate::value::Desired;

/// Request of the host. The MCU sends exactly one [`crate::Reply`] to each, with the same sequence number.
///
/// The order of the variants defines their codes on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Asks for a session. The reply is the status, stamped with the nonce of a new session, which begins with the first
    /// request that carries it. A `Hello` alone has no effect: it is no sign of life, and the running session goes on.
    Hello,
    /// Reads the status.
    Status,
    /// Sets the desired stiffness. Rejected unless armed, and if it is out of range.
    Set(Desired),
    /// Enables the output with a target of 0 V.
    Arm,
    /// Disables the output. Executed in any session or none, with any sequence number and from any protocol version. It
    /// does not acknowledge a fault.
    Disarm,
    /// Acknowledges the given fault; rejected if another fault is present.
    Acknowledge(Fault),
    /// Restarts the measurement of the host's silence and has no other effect.
    Heartbeat,
    /// Starts periodic telemetry. It stops with `every_ticks` = 0, with a new session, and while the host is silent.
    Stream {
        /// Period of the samples, in ticks; 0 stops them.
        every_ticks: u16,
    },
    /// Reads the identities of the running and of the stored model.
    Model,
    /// Sends a part of a model's payload; part 0 starts a new transfer. Rejected out of order, while armed, and while
    /// faulted unless a `config` fault stands.
    ModelPart {
        /// Number of the part, counted from 0.
        number: u8,
        /// Content; the last part is padded with zeros.
        bytes: [u8; PART],
    },
    /// Ends the transfer: the model is validated and stored, and runs from the next start on. Rejected as a part is.
    ModelEnd {
        /// Length of the payload, in bytes.
        length: u16,
        /// CRC-32C of the payload.
        checksum: u32,
    },
    /// Restarts the MCU with the stored model and settings. Rejected as a part of a model is.
    Restart,
    /// Informs the MCU that the report of a fault with this number has arrived, so that it is not repeated. It acknowledges
    /// no fault.
    Heard {
        /// Number of the report, see [`crate::FaultReport::number`].
        number: u32,
    },
    /// Reads the identities of the running and of the stored settings.
    Settings,
    /// Sends a part of the settings' payload, as [`Request::ModelPart`].
    SettingsPart {
        /// Number of the part, counted from 0.
        number: u8,
        /// Content; the last part is padded with zeros.
        bytes: [u8; PART],
    },
    /// Ends the transfer of settings, as [`Request::ModelEnd`].
    SettingsEnd {
        /// Length of the payload, in bytes.
        length: u16,
        /// CRC-32C of the payload.
        checksum: u32,
    },
    /// Reads a part of the payload of settings.
    ReadSettings {
        /// True for the settings that are built into the image, false for those that run.
        built_in: bool,
        /// Number of the part, counted from 0.
        number: u8,
    },
    /// Starts or reads the fast capture.
    Capture(Capture),
    /// Reads what the isolation bank says, or ends its alarm.
    Isolation(Isolation),
    /// Reads what the adaptation does, or switches it.
    Adaptation(Adaptation),
    /// Reads the level of the brown-out reset.
    BrownOut,
}

impl Request {
    /// First byte of a serialised [`Request::Disarm`]. It is the same in every protocol version, so that any host can disarm
    /// any MCU.
    pub(crate) const DISARM: u8 = 4;

    /// The requests that send a payload of at most 256 parts of [`PART`] bytes: the parts in order, then the end.
    pub fn sending(block: Block, payload: &[u8]) -> impl Iterator<Item = Self> {
        let parts = Part::all(payload).map(move |Part { number, bytes, .. }| match block {
            Block::Model => Self::ModelPart { number, bytes },
            Block::Settings => Self::SettingsPart { number, bytes },
        });
        let (length, checksum) = (payload.len() as u16, checksum(payload));
        let end = match block {
            Block::Model => Self::ModelEnd { length, checksum },
            Block::Settings => Self::SettingsEnd { length, checksum },
        };
        parts.chain(core::iter::once(end))
    }
}
