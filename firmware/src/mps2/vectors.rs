//! The interrupts in use.

use cortex_m::interrupt::InterruptNumber;

use super::{time, uart};
use crate::stop;
use embassy_executor::InterruptExecutor;
use model::supervisor::Fault;

/// Runs the control task.
pub static HIGH: InterruptExecutor = InterruptExecutor::new();
/// Runs everything else.
pub static LOW: InterruptExecutor = InterruptExecutor::new();

/// An interrupt line.
#[derive(Clone, Copy, Debug)]
#[repr(u16)]
pub enum Line {
    /// The host's line has a byte.
    Received = 0,
    /// The host's line takes another byte.
    Sent = 1,
    /// Time base at its end.
    Timer0 = 8,
    /// Alarm.
    Timer1 = 9,
    /// Connected to nothing: pended by software.
    High = 28,
    /// Connected to nothing: pended by software.
    Low = 29,
}

// SAFETY: the numbers are those of the table below.
unsafe impl InterruptNumber for Line {
    fn number(self) -> u16 {
        self as u16
    }
}

type Handler = unsafe extern "C" fn();

unsafe extern "C" {
    fn DefaultHandler();
}

unsafe extern "C" fn timer_0() {
    time::on_wrap();
}

unsafe extern "C" fn timer_1() {
    time::on_alarm();
}

unsafe extern "C" fn received() {
    uart::on_received();
}

unsafe extern "C" fn sent() {
    uart::on_sent();
}

unsafe extern "C" fn high() {
    // SAFETY: the line is enabled by `HIGH.start`.
    unsafe { HIGH.on_interrupt() }
}

unsafe extern "C" fn low() {
    // SAFETY: the line is enabled by `LOW.start`.
    unsafe { LOW.on_interrupt() }
}

/// The watchdog's first zero: its second one resets, so use the time to say why.
#[unsafe(no_mangle)]
extern "C" fn NonMaskableInt() {
    stop::on_fresh_stack(Fault::Watchdog)
}

/// The linker puts this behind the processor's own vectors.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [Handler; 32] = {
    let mut table: [Handler; 32] = [DefaultHandler; 32];
    table[Line::Received as usize] = received;
    table[Line::Sent as usize] = sent;
    table[Line::Timer0 as usize] = timer_0;
    table[Line::Timer1 as usize] = timer_1;
    table[Line::High as usize] = high;
    table[Line::Low as usize] = low;
    table
};
