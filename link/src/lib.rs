//! The serial link between the robot's computer (host) and the amplifier's MCU.
//!
//! The host asks, the MCU answers; the MCU pushes nothing but telemetry that was asked for. Used by both sides: no heap,
//! no `unsafe`, no hardware. The whole protocol, with what happens on each fault, is in `docs/link.md`.
//!
//! ```text
//! frame = 0x00, COBS( version, kind, sequence (2 bytes, low first), postcard(message), CRC-32C (4 bytes, low first) ), 0x00
//! ```
//!
//! | module | what it is |
//! | --- | --- |
//! | [`request`], [`reply`], [`reason`] | the messages |
//! | [`value`] | voltages and desired stiffness as they travel |
//! | [`wire_model`] | a spring's model as it is sent and stored |
//! | [`fault`], [`field`] | codes of what went wrong in the MCU, and of what is wrong with a model |
//! | [`frame`] | message to bytes, and a checked packet back to a message |
//! | [`receiver`] | bytes to checked packets; finds its way back after damage |
//! | [`sequence`] | which of two sequence numbers is newer |
//! | [`order`] | from a request to what the supervisor is told |
//! | [`session`] | the MCU's side: what to apply, what to answer, how long the host has been silent |
//! | [`desk`] | the MCU's side, whole: between the wire and the control tick |
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod desk;
pub mod fault;
pub mod field;
pub mod frame;
pub mod order;
pub mod reason;
pub mod receiver;
pub mod reply;
pub mod request;
pub mod sequence;
pub mod session;
mod stuffing;
pub mod value;
pub mod wire_model;

pub use desk::{About, Desk, Keep, Step, View};
pub use fault::Fault;
pub use field::Field;
pub use frame::{Frame, Message, Packet, Unreadable};
pub use order::Order;
pub use reason::Reason;
pub use receiver::Receiver;
pub use reply::{Controller, Models, Reply, State, Status, Telemetry};
pub use request::Request;
pub use sequence::Sequence;
pub use session::{Action, Session};
pub use value::{Desired, WireVolts};
pub use wire_model::{ModelId, WireModel};

/// Version of the protocol. Any change of a golden frame in `tests/golden.rs` needs a new one.
pub const VERSION: u8 = 4;
