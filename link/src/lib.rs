//! The serial link between the robot's computer (host) and the amplifier's MCU. It needs no heap, no `unsafe` code and no
//! hardware; both ends use it. `docs/link.md` specifies the protocol and the reaction to every fault.
//!
//! | term | meaning |
//! | --- | --- |
//! | frame | The bytes on the wire between two `0x00` delimiters: one packet, encoded with COBS. |
//! | packet | Version, kind, sequence number, message and CRC-32C. |
//! | message | A [`Request`] of the host, or a [`Reply`] or [`Notice`] of the MCU, serialised with postcard. |
//! | sequence number | 16-bit request counter modulo 65 536; a reply carries the number of its request. |
//! | session | At most 65 536 requests of one host after its `Hello`, each with the session's nonce. |
//! | nonce | 32-bit number of a session, which the MCU gives: no other session has it. |
//! | command | What one request changes in the control tick: [`Command`]. |
//! | telemetry | Samples of the control loop that the MCU sends periodically once the host has requested them. |
//!
//! ```text
//! frame = 0x00, COBS( version, kind, sequence (2 bytes), postcard(message), session (4 bytes), CRC-32C (4 bytes) ), 0x00
//! ```
//!
//! The host sends requests, the MCU replies. Apart from replies the MCU sends telemetry on request, notices with it, and reports of
//! faults.
//!
//! | module | content |
//! | --- | --- |
//! | [`request`], [`reply`], [`reason`], [`notice`] | The messages. |
//! | [`telemetry`] | One sample of the control loop, and the state of the output. |
//! | [`value`] | Voltages and desired stiffness in their wire format. |
//! | [`block`] | Blocks that the MCU stores: their identity, and the parts in which they are sent. |
//! | [`capture`] | Rows of the fast capture, and the requests that start and read it. |
//! | [`isolation`], [`adaptation`] | What the isolation bank says and what the adaptation does, and the requests for it. |
//! | [`wire_model`], [`wire_settings`] | A spring's model and the MCU's settings in the format in which they are sent and stored. |
//! | [`fault`], [`field`] | Numeric codes of the MCU's faults and of the fields of a model or of settings. |
//! | [`diagnosis`] | Numeric codes of what the amplifier's monitors and the sensor show. |
//! | [`frame`] | Encoding of a message and decoding of a packet. |
//! | [`checksum`](mod@checksum) | CRC-32C. |
//! | [`receiver`] | Bytes in, packets with a correct CRC out; resynchronises after corrupted bytes. |
//! | [`sequence`], [`nonce`] | Order of sequence numbers, and the numbers of sessions. |
//! | [`command`] | Conversion of a request into a command for the control tick. |
//! | [`session`] | Acceptance, repetition and rejection of requests, and the host's silence. |
//! | [`server`] | The MCU's end of the link: bytes in, commands and replies out. |
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod adaptation;
pub mod block;
pub mod capture;
pub mod checksum;
pub mod command;
pub mod diagnosis;
pub mod fault;
pub mod field;
pub mod frame;
pub mod isolation;
pub mod nonce;
pub mod notice;
pub mod reason;
pub mod receiver;
pub mod reply;
pub mod request;
pub mod sequence;
pub mod server;
pub mod session;
mod stuffing;
pub mod telemetry;
pub mod value;
pub mod wire_model;
pub mod wire_settings;

pub use adaptation::AdaptationReport;
pub use block::{Block, BlockId, Blocks, Part};
pub use command::Command;
pub use diagnosis::{Mismatch, Sensor};
pub use fault::Fault;
pub use field::Field;
pub use frame::{Frame, Message, Packet, Unreadable};
pub use isolation::IsolationReport;
pub use nonce::{Nonce, Stamp};
pub use notice::Notice;
pub use reason::Reason;
pub use receiver::Receiver;
pub use reply::{BrownOut, Controller, FaultReport, Reply, Status};
pub use request::Request;
pub use sequence::Sequence;
pub use server::{About, Server, Step, Update, View};
pub use session::{Action, Session};
pub use telemetry::{State, Telemetry};
pub use value::{Desired, WireVolts};
pub use wire_model::WireModel;
pub use wire_settings::WireSettings;

/// Version of the protocol. Any change of a golden frame in `tests/golden.rs` requires a new number.
pub const VERSION: u8 = 5;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
