//! What the host asks.

use serde::{Deserialize, Serialize};

use crate::fault::Fault;
use crate::value::Desired;
use crate::wire_model::PART;

/// A request. Each is answered by exactly one [`crate::Reply`] with the request's own sequence number.
///
/// The order of the variants is their code on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Opens the talk: sequence numbers start anew from this frame's, telemetry stops. Answered with the status.
    Hello,
    /// Answered with the status.
    Status,
    /// Follow this stiffness. Refused unless armed, and if it is out of reach.
    Set(Desired),
    /// Let voltage out. The target starts at 0 V, whatever was set before.
    Arm,
    /// Take the voltage away. Always applied: without a Hello, late, and from any protocol version. Leaves a fault as it is.
    Disarm,
    /// Leave the fault state, but only if it still is this fault.
    Acknowledge(Fault),
    /// Says that the host is alive, nothing else.
    Heartbeat,
    /// Push telemetry every so many ticks; 0 stops it. It also stops with Hello and when the host falls silent.
    Stream {
        /// Ticks between two samples.
        every_ticks: u16,
    },
    /// Answered with the models: the one that runs and the one that is stored.
    Model,
    /// A part of a model's payload. Number 0 begins anew; refused out of order, and unless disarmed.
    ModelPart {
        /// From 0.
        number: u8,
        /// The last part is filled up with zeros.
        bytes: [u8; PART],
    },
    /// The payload is complete: check it, and store it if it is sound. It runs from the next start on. Refused unless
    /// disarmed.
    ModelEnd {
        /// Of the payload, in bytes.
        length: u16,
        /// CRC-32C of the payload.
        checksum: u32,
    },
    /// Start anew, with the stored model. Refused unless disarmed.
    Restart,
}

impl Request {
    /// [`Request::Disarm`] as its bytes. They never change, so that every version can disarm every other.
    pub(crate) const DISARM: &'static [u8] = &[4];
}
