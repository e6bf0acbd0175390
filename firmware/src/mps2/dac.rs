//! The amplifier port of the emulated board.
//!
//! The board has no converter. What would be written to one goes out through a UART instead, two bytes a tick, and the
//! emulator puts them into a file: the host sees every code that left, whatever the log says.
//!
//! ```text
//! 1 E c c c c c c   E: enabled, c: code, upper 6 bits
//! 0 0 c c c c c c   lower 6 bits
//! ```

use model::supervisor::Drive;

use super::registers::{FAULT_STATUS, UART_1_CONTROL, UART_1_DATA, UART_1_DIVIDER};
use super::semihosting;
use crate::board::Amplifier;

/// See `floats_are_free`.
const EXIT_LAZY_SAVE_FAILED: u32 = 3;

/// The wire.
#[derive(Debug)]
pub struct Dac;

impl Amplifier for Dac {
    fn put(&mut self, drive: Drive) {
        send(u32::from(drive.code().0), drive.enabled());
    }
}

/// Zero volts, amplifier off: from any context, even with nothing set up.
pub fn kill() {
    UART_1_DIVIDER.write(16);
    UART_1_CONTROL.write(1);
    send(0, false);
    floats_are_free();
}

/// Whoever stops the program may use a float register. Ends the emulator if that makes the processor save the old ones on a
/// stack that ran out.
fn floats_are_free() {
    /// CFSR.MLSPERR
    const LAZY_SAVE_FAILED: u32 = 1 << 5;
    // SAFETY: does nothing.
    unsafe { core::arch::asm!("vmov s0, s0") };
    if FAULT_STATUS.read() & LAZY_SAVE_FAILED != 0 {
        semihosting::exit(EXIT_LAZY_SAVE_FAILED);
    }
}

fn send(code: u32, enabled: bool) {
    UART_1_DATA.write(1 << 7 | u32::from(enabled) << 6 | (code >> 6 & 0x3f));
    UART_1_DATA.write(code & 0x3f);
}
