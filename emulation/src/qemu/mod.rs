//! Runs an image under QEMU.
//!
//! In: an image, and the name of a script of the firmware's or a host that commands it. Out: the decoded log and every
//! code on the DAC's wire ([`emulator`]), and whether both are the host's, bit for bit ([`comparison`]).

pub(crate) mod comparison;
pub(crate) mod emulator;
mod warnings;
