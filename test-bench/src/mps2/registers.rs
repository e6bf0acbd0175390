//! Addresses of the registers in use. Source: ARM DDI 0479 (CMSDK) and application note AN386.

/// Clock of processor and peripherals, in Hz.
pub const CLOCK_HZ: u32 = 25_000_000;

/// A register with 32 bits.
#[derive(Clone, Copy, Debug)]
pub struct Register(u32);

impl Register {
    /// Reads the register.
    #[inline(always)]
    pub fn read(self) -> u32 {
        // SAFETY: every constant of this type below is a register of this board.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    /// Writes the register.
    #[inline(always)]
    pub fn write(self, value: u32) {
        // SAFETY: see `read`.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }
}

/// Registers of a CMSDK timer, which counts down at the processor's clock.
#[derive(Debug)]
pub struct Timer {
    /// Bit 0 enables the timer, bit 3 its interrupt.
    pub control: Register,
    /// Current count.
    pub value: Register,
    /// Value after the count reaches zero; 0 stops the timer there.
    pub reload: Register,
    /// Bit 0 is set when the count reaches zero, and cleared by writing 1.
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

/// Timer of the time base.
pub const TIMER_0: Timer = Timer::at(0x4000_0000);
/// Timer of the alarm.
pub const TIMER_1: Timer = Timer::at(0x4000_1000);

/// UART 0, the line to the host: byte to send, or received byte.
pub const UART_0_DATA: Register = Register(0x4000_4000);
/// UART 0: bit 0 is set while the send buffer is full, bit 1 while a received byte is available.
pub const UART_0_STATE: Register = Register(0x4000_4004);
/// UART 0: bit 0 enables sending, bit 1 receiving, bits 2 and 3 their interrupts.
pub const UART_0_CONTROL: Register = Register(0x4000_4008);
/// UART 0: bit 0 is set after sending, bit 1 after receiving; cleared by writing 1.
pub const UART_0_INTERRUPT: Register = Register(0x4000_400c);
/// UART 0: clock cycles per bit, at least 16.
pub const UART_0_DIVIDER: Register = Register(0x4000_4010);

/// UART 1, the amplifier port: byte to send.
pub const UART_1_DATA: Register = Register(0x4000_5000);
/// UART 1: bit 0 enables sending.
pub const UART_1_CONTROL: Register = Register(0x4000_5008);
/// UART 1: clock cycles per bit, at least 16.
pub const UART_1_DIVIDER: Register = Register(0x4000_5010);

/// Watchdog: initial value of the down-counter.
pub const WATCHDOG_LOAD: Register = Register(0x4000_8000);
/// Watchdog: bit 0 enables the interrupt at the first zero, bit 1 the reset at the second.
pub const WATCHDOG_CONTROL: Register = Register(0x4000_8008);
/// Watchdog: writing any value restarts the counter.
pub const WATCHDOG_FEED: Register = Register(0x4000_800c);

/// SysTick: reload value, 24 bits.
pub const SYSTICK_RELOAD: Register = Register(0xe000_e014);
/// SysTick: current value; counts down.
pub const SYSTICK_VALUE: Register = Register(0xe000_e018);

/// Cause of the last fault (CFSR).
pub const FAULT_STATUS: Register = Register(0xe000_ed28);
