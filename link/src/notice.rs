//! What the MCU sends with the telemetry, in frames of a kind of their own: a host that does not know them drops them.

use serde::{Deserialize, Serialize};

use crate::frame::Message;
use crate::isolation::IsolationReport;

/// Message that the MCU sends without a request while telemetry is being sent. The order of the variants defines their codes on the
/// wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Notice {
    /// What the isolation bank says: after the request for telemetry, when the verdict changes, and once per second.
    Isolation(IsolationReport),
}

impl Message for Notice {
    const KIND: u8 = b'N';
}
