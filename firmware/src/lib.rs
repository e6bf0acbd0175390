//! Timing and input/output of the stiffness controller on the amplifier's MCU: everything that is flashed.
//!
//! | term | meaning |
//! | --- | --- |
//! | tick | One period of the control task, 1 ms: read inputs, compute, write the DAC. |
//! | command | What the host changes in one tick, see [`link::Command`]. |
//! | overrun | Ticks that were missed because the control task ran late. |
//! | crash record | A record in RAM that survives a reset and contains the fault that caused it. |
//!
//! | module | content |
//! | --- | --- |
//! | [`board`] | Traits that a board implements. |
//! | [`control`] | One control tick: supervisor, model, supervisor. |
//! | [`fault_lines`] | Faults whose lines of the log are not queued yet. |
//! | [`isolation`] | Fault isolation after each control tick. |
//! | [`mailbox`] | Hand-over of commands to the control tick; drops commands that a fault has made obsolete. |
//! | [`capture`] | The fast capture: every tick in a row of RAM. |
//! | [`clock_test`] | Test of the processor's clock at the start: the plausible range. |
//! | [`pace`] | Time of the next tick, and the number of missed ticks. |
//! | [`reset_cause`] | Cause of the last reset, from the chip's flags and the crash record. |
//! | [`settings`] | Settings that are built into an image. |
//! | [`start`] | Settings and controller at the start, from the stored settings and model. |
//! | [`store`] | Storage of a model and of settings in flash, safe against power cuts. |
//! | [`task_watchdog`] | Check that every task is alive, before the hardware watchdog is fed. |
//! | [`update`] | Updates of the store by the host, with the check before they are sealed. |
//! | `capture_memory` | Memory of the fast capture. |
//! | `crash_record` | Memory of the crash record. |
//! | `guards` | Check of RAM and image, and start of both guards. |
//! | `hang_guard` | Stop of a control task that hangs. |
//! | `host` | Communication with the host. |
//! | `image_check` | Check of the image against its checksum. |
//! | `log` | All log lines. |
//! | `nucleo` | The board NUCLEO-G474RE. |
//! | `ram_test` | Test of the RAM at the start. |
//! | `stack_guard` | Detection of a stack overflow. |
//! | `stop` | Emergency stop after a panic, hard fault or unexpected interrupt. |
//! | `tasks` | Control task and housekeeping task. |
//!
//! The modules with links build on a host as well, where their results can be compared with the MCU's bit for bit. The others
//! require the feature `mcu`.
//!
#![doc = include_str!("pins.md")]
#![no_std]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod adaptation;
pub mod board;
pub mod capture;
pub mod clock_test;
pub mod control;
pub mod fault_lines;
pub mod isolation;
pub mod mailbox;
pub mod pace;
pub mod reset_cause;
pub mod settings;
pub mod start;
pub mod store;
pub mod task_watchdog;
pub mod update;

#[cfg(feature = "mcu")]
pub mod capture_memory;
#[cfg(feature = "mcu")]
pub mod crash_record;
#[cfg(feature = "mcu")]
pub mod guards;
#[cfg(feature = "mcu")]
pub mod hang_guard;
#[cfg(feature = "mcu")]
pub mod host;
#[cfg(feature = "mcu")]
pub mod image_check;
#[cfg(feature = "mcu")]
pub mod log;
#[cfg(feature = "nucleo-g474re")]
pub mod nucleo;
#[cfg(feature = "mcu")]
pub mod ram_test;
#[cfg(feature = "mcu")]
pub mod stack_guard;
#[cfg(feature = "mcu")]
pub mod stop;
#[cfg(feature = "mcu")]
pub mod tasks;

pub use settings::{LONGEST_HANG_MS, RATE_HZ};
