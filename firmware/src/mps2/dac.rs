//! The amplifier port of the emulated board.
//!
//! The board has no converter. What would be written to one goes out through a UART instead, two bytes a tick, and the
//! emulator puts them into a file: the host sees every code that left, whatever the log says.
//!
//! ```text
//! 1 E c c c c c c   E: enabled, c: code, upper 6 bits
//! 0 0 c c c c c c   lower 6 bits
//! ```
//!
//! [`Dac::connect`] puts a spring behind it, in lock step: every code also goes into a pipe, and the next tick waits for
//! what the spring's sensor makes of it. None of the board's time passes meanwhile, so that a run is the same each time.
//!
//! ```text
//! to the spring:   code (2 bytes, low first), bit 15: enabled
//! from the spring: reading in 2^-20 V (4 bytes, low first), the smallest number: none
//! ```

use model::Volts;
use model::supervisor::Drive;
use model::units::Signal;

use super::registers::{FAULT_STATUS, UART_1_CONTROL, UART_1_DATA, UART_1_DIVIDER};
use super::semihosting::{self, File, Mode};
use crate::board::Amplifier;

/// The spring does not answer.
const EXIT_SPRING_GONE: u32 = 4;
/// See `floats_are_free`.
const EXIT_LAZY_SAVE_FAILED: u32 = 3;

/// The wire, and the spring behind it.
#[derive(Debug, Default)]
pub struct Dac {
    spring: Option<(File, File)>,
    measured: Option<Volts>,
}

impl Dac {
    /// Waits for the spring at the pipes `to-spring` and `from-spring` in the emulator's folder. True if it is there.
    pub fn connect(&mut self) -> bool {
        self.spring = File::open(c"to-spring", Mode::Write).zip(File::open(c"from-spring", Mode::Read));
        self.spring.is_some()
    }
}

impl Amplifier for Dac {
    fn put(&mut self, drive: Drive) {
        send(u32::from(drive.code().0), drive.enabled());
        let Some((to, from)) = &mut self.spring else { return };
        let mut reading = [0; 4];
        let sent = to.write(&(drive.code().0 | u16::from(drive.enabled()) << 15).to_le_bytes());
        if !sent || !from.read(&mut reading) {
            semihosting::exit(EXIT_SPRING_GONE);
        }
        let bits = i32::from_le_bytes(reading);
        self.measured = (bits != i32::MIN).then_some(Volts(Signal::from_bits(bits)));
    }

    fn measured(&mut self) -> Option<Volts> {
        self.measured
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
