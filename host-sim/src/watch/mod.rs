//! `vsj watch`: the running loop on a full screen, with keys that command it.
//!
//! In: an open connection to an MCU, what is typed, and signals. Out: a screen, recordings as CSV, and requests to the MCU; at
//! the end the MCU is disarmed and the terminal is as it was.
//!
//! ```text
//! MCU <-> worker (thread) --Event--> View --draw--> terminal
//!            ^                        ^
//!            +--------Order-----------+---- keys
//! ```
//!
//! | module | what it is |
//! | --- | --- |
//! | [`message`] | what the worker reports, and what it is asked |
//! | [`worker`] | the thread that owns the connection: requests, telemetry, schedule, reconnection |
//! | `recorder` | the files that are written meanwhile |
//! | `history` | the samples of the last minutes, and those of them that a plot shows |
//! | [`view`], `keys` | the state of the screen: events and keys in, orders out; no clock, no port, no terminal |
//! | [`draw`] | the state as text and plots, for any size of the terminal |
//! | [`terminal`] | the full screen, and how it is left, also after a panic |
//! | [`session`] | the loop that joins them, on a full screen or line by line |
//! | [`emulated`] | finds or builds the emulated board's image and runs it |

pub mod draw;
pub mod emulated;
mod history;
mod keys;
pub mod message;
mod recorder;
pub mod session;
pub mod terminal;
pub mod view;
pub mod worker;

pub use recorder::Names;
pub use session::run;
pub use worker::Settings;
