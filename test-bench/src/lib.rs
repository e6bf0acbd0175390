//! Test bench of the firmware: the same scripted runs on a host and on an emulated board, compared bit for bit.
//!
//! A run starts with the name of a [`Script`](script::Script) and ends with the [`Digest`](digest::Digest) of every DAC code and
//! every estimate. No image that is flashed contains this crate.
//!
//! | module | content |
//! | --- | --- |
//! | `adaptation` | A run of the adaptation, for counting instructions (feature `adaptation`). |
//! | `blocks` | Runs of the tick with each kind of spring and each controller, for counting instructions (feature `robust`). |
//! | [`digest`] | Checksum of a whole run. |
//! | [`isolation`] | A run of the isolation bank with the controller, for counting instructions. |
//! | [`script`] | Commands and injected faults of every run. |
//! | [`simulation`] | Execution of a script on a host, without a board. |
//! | [`target`] | Random target voltages. |
//! | `mps2` | The emulated board. |
//! | `player` | Execution of a script on the emulated board. |
//!
//! `mps2` and `player` require the feature `mps2-an386`; the other modules build on any host.
#![no_std]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate std;

#[cfg(feature = "adaptation")]
pub mod adaptation;
#[cfg(feature = "robust")]
pub mod blocks;
pub mod digest;
pub mod isolation;
pub mod script;
pub mod simulation;
pub mod target;

#[cfg(feature = "mps2-an386")]
pub mod mps2;
#[cfg(feature = "mps2-an386")]
pub mod player;
