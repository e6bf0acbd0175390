//! When things happen on the MCU, and on which pin.
//!
//! | module | what it is |
//! | --- | --- |
//! | `blocks` | the tick of each kind of spring under each controller, to be counted (feature `fast`) |
//! | [`board`] | what a board must be able to do |
//! | [`cause`] | why the chip was reset |
//! | [`control`] | one control tick: supervisor, model, supervisor |
//! | [`pace`] | when the next tick is due, and how many were missed |
//! | [`post`] | between the host's task and the tick: an order made before a fault never acknowledges it |
//! | [`roll_call`] | the watchdog is fed only when every task has checked in |
//! | [`store`] | the model that outlives a power cut |
//! | [`start`] | the controller, from what is stored |
//! | [`script`] | runs of the emulated firmware: the stair, random commands, fault drills |
//! | [`rehearsal`] | the same without a board, for the host |
//! | [`settings`] | what an image runs |
//! | [`digest`] | one number for a whole run |
//! | `last_words`, `stop` | what survives a reset; panic and hard fault |
//! | `hang_guard` | a control task that hangs is stopped |
//! | `stack_guard` | an overflow of the stack is a fault |
//! | `log` | every log line, in one place |
//! | `tasks` | the control task and the housekeeping below it |
//! | `host` | the host's task, and its orders as the control task sees them |
//! | `mps2` | the emulated board |
//! | `nucleo` | the real board |
//!
//! The modules with links build on a host too: they are the half of the firmware that can be compared bit for bit.
#![no_std]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate std;

#[cfg(feature = "fast")]
pub mod blocks;
pub mod board;
pub mod cause;
pub mod control;
pub mod digest;
pub mod pace;
pub mod post;
pub mod rehearsal;
pub mod roll_call;
pub mod script;
pub mod settings;
pub mod start;
pub mod store;

#[cfg(feature = "mcu")]
pub mod hang_guard;
#[cfg(feature = "mcu")]
pub mod host;
#[cfg(feature = "mcu")]
pub mod last_words;
#[cfg(feature = "mcu")]
pub mod log;
#[cfg(feature = "mps2-an386")]
pub mod mps2;
#[cfg(feature = "nucleo-g474re")]
pub mod nucleo;
#[cfg(feature = "mcu")]
pub mod stack_guard;
#[cfg(feature = "mcu")]
pub mod stop;
#[cfg(feature = "mcu")]
pub mod tasks;

/// Ticks per second.
pub const RATE_HZ: u32 = 1000;

/// Longest time without a tick before `hang_guard` stops the program, in ms: more than the supervisor forgives, so that a
/// late task can still say so itself.
pub const LONGEST_HANG_MS: u32 = 12;
