//! The host's side of the serial link to the MCU. The messages are those of the `link` crate.
//!
//! | item | what it is |
//! | --- | --- |
//! | [`Port`] | a serial device, a unix socket or a TCP socket, as bytes |
//! | [`Client`] | asks, waits, asks again; collects telemetry |
//! | [`StatusReport`], [`Row`] | what the MCU says, as text and JSON |

mod client;
mod port;
mod report;

pub use client::{Client, Failure, Patience};
pub use port::Port;
pub use report::{Row, StatusReport};
