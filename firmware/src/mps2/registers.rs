//! The addresses in use. ARM DDI 0479 (CMSDK) and AN386.

/// Clock of processor and peripherals, in Hz.
pub const CLOCK_HZ: u32 = 25_000_000;

/// A register.
#[derive(Clone, Copy, Debug)]
pub struct Register(u32);

impl Register {
    /// Reads it.
    #[inline(always)]
    pub fn read(self) -> u32 {
        // SAFETY: every constant of this type below is a register of this board.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    /// Writes it.
    #[inline(always)]
    pub fn write(self, value: u32) {
        // SAFETY: as above.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }
}

/// A CMSDK timer: counts down at the clock.
#[derive(Debug)]
pub struct Timer {
    /// Bit 0 counts, bit 3 interrupts.
    pub control: Register,
    /// The count.
    pub value: Register,
    /// Where it goes on after zero; with zero it stops there.
    pub reload: Register,
    /// Bit 0 is set at zero, and cleared by writing one.
    pub interrupt: Register,
}

impl Timer {
    const fn at(base: u32) -> Self {
        Self {
            control: Register(base),
            value: Register(base + 4),
            reload: Register(base + 8),
            interrupt: Register(base + 12),
        }
    }
}

/// Time base.
pub const TIMER_0: Timer = Timer::at(0x4000_0000);
/// Alarm.
pub const TIMER_1: Timer = Timer::at(0x4000_1000);

/// UART 0, the host's line: a byte to send, or one that came.
pub const UART_0_DATA: Register = Register(0x4000_4000);
/// Bit 0: the last byte to send is still here. Bit 1: a byte has come.
pub const UART_0_STATE: Register = Register(0x4000_4004);
/// Bit 0 sends, bit 1 receives, bits 2 and 3 interrupt after it.
pub const UART_0_CONTROL: Register = Register(0x4000_4008);
/// Bit 0 sent, bit 1 received; cleared by writing ones.
pub const UART_0_INTERRUPT: Register = Register(0x4000_400c);
/// Clock cycles a bit, at least 16.
pub const UART_0_DIVIDER: Register = Register(0x4000_4010);

/// UART 1, the amplifier's wire: a byte to send.
pub const UART_1_DATA: Register = Register(0x4000_5000);
/// Bit 0 sends.
pub const UART_1_CONTROL: Register = Register(0x4000_5008);
/// Clock cycles a bit, at least 16.
pub const UART_1_DIVIDER: Register = Register(0x4000_5010);

/// Watchdog: where it counts down from.
pub const WATCHDOG_LOAD: Register = Register(0x4000_8000);
/// Bit 0 interrupts at the first zero, bit 1 resets at the second.
pub const WATCHDOG_CONTROL: Register = Register(0x4000_8008);
/// Any value starts anew.
pub const WATCHDOG_FEED: Register = Register(0x4000_800c);

/// SysTick: 24 bits.
pub const SYSTICK_RELOAD: Register = Register(0xe000_e014);
/// Counts down.
pub const SYSTICK_VALUE: Register = Register(0xe000_e018);

/// Why the last fault came (CFSR).
pub const FAULT_STATUS: Register = Register(0xe000_ed28);
