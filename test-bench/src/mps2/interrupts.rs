//! Numbers of the interrupts in use.

use cortex_m::interrupt::InterruptNumber;

/// An interrupt of the emulated board.
#[derive(Clone, Copy, Debug)]
#[repr(u16)]
pub enum Interrupt {
    /// UART 0 has received a byte.
    Received = 0,
    /// UART 0 has sent a byte.
    Sent = 1,
    /// The time base has wrapped around.
    Timer0 = 8,
    /// The alarm has expired.
    Timer1 = 9,
    /// Executor of the control task: not connected, pended by software.
    High = 28,
    /// Executor of all other tasks: not connected, pended by software.
    Low = 29,
}

// SAFETY: the numbers are within the interrupt table of this board.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}
