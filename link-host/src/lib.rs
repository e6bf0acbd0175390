//! The host's side of the serial link to the MCU; the messages are defined in the `link` crate.
//!
//! | item | what it is |
//! | --- | --- |
//! | [`Port`] | a serial device, a unix socket or a TCP socket, as bytes |
//! | [`Client`] | sends requests and repeats them until they are answered; collects telemetry |
//! | [`fault`], [`desired`] | the fault with a name or a number; the stiffness that a text with its unit names |
//! | [`refusal`] | why the MCU has rejected a request, with the unit of its bounds |
//! | [`not_disarmed`] | what to say of an MCU that has not confirmed that its output is disabled |
//! | [`heartbeat`] | how often an armed MCU must hear of its host |
//! | [`StatusReport`], [`IsolationRow`], [`AdaptationRow`], [`Row`] | status, isolation bank, adaptation and telemetry of the MCU, as text and JSON |
// They panic on a closed pipe; `vsj` prints in its `output::terminal`.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod client;
mod command;
mod failure;
mod port;
mod report;
mod requests;

pub use client::{Client, MOST_SAMPLES, Patience, heartbeat};
pub use command::{desired, fault, not_disarmed, refusal};
pub use failure::Failure;
pub use port::Port;
pub use report::{AdaptationRow, FaultRow, IsolationRow, Row, StatusReport};
