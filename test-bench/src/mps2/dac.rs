//! The amplifier port of the emulated board.
//!
//! The board has no converter. The codes are sent through a UART instead, two bytes per tick, which the emulator writes to a
//! file: the host sees every code that was output, independently of the log.
//!
//! ```text
//! 1 E c c c c c c   E: enabled, c: code, upper 6 bits
//! 0 0 c c c c c c   lower 6 bits
//! ```
//!
//! [`Dac::connect`] connects a simulated spring, in lock step: every code is also written to a pipe, and the tick waits for
//! the reading of the spring's sensor. The board's clock stands still meanwhile, so that a run is reproducible.
//!
//! ```text
//! to the spring:   code (2 bytes, low first), bit 15: enabled
//! from the spring: reading in 2^-20 V (4 bytes, low first), the smallest number for no reading
//! ```

use firmware::board::Amplifier;
use model::Volts;
use model::supervisor::Drive;
use model::units::Signal;

use super::registers::{FAULT_STATUS, UART_1_CONTROL, UART_1_DATA, UART_1_DIVIDER};
use super::semihosting::{self, File, Mode};

/// Exit code: the simulated spring does not answer.
const EXIT_SPRING_GONE: u32 = 4;
/// Exit code, see `check_lazy_save`.
const EXIT_LAZY_SAVE_FAILED: u32 = 3;

/// The amplifier port, and the simulated spring if one is connected.
#[derive(Debug, Default)]
pub struct Dac {
    spring: Option<(File, File)>,
    measured: Option<Volts>,
}

impl Dac {
    /// Connects the spring at the pipes `to-spring` and `from-spring` in the emulator's folder. False if they do not exist.
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

/// Sets 0 V and disables the amplifier by register access, in any context, even before the initialisation.
#[unsafe(no_mangle)]
pub fn switch_amplifier_off() {
    UART_1_DIVIDER.write(16);
    UART_1_CONTROL.write(1);
    send(0, false);
    check_lazy_save();
}

/// Uses a float register, as the emergency stop may. Ends the emulator if that makes the processor save the old registers on
/// a stack that has overflowed.
fn check_lazy_save() {
    /// Bit MLSPERR of the register CFSR.
    const LAZY_SAVE_FAILED: u32 = 1 << 5;
    // SAFETY: changes no register.
    unsafe { core::arch::asm!("vmov s0, s0") };
    if FAULT_STATUS.read() & LAZY_SAVE_FAILED != 0 {
        semihosting::exit(EXIT_LAZY_SAVE_FAILED);
    }
}

fn send(code: u32, enabled: bool) {
    UART_1_DATA.write(1 << 7 | u32::from(enabled) << 6 | (code >> 6 & 0x3f));
    UART_1_DATA.write(code & 0x3f);
}
