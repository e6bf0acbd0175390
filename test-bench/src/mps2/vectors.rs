//! Interrupt handlers and executors.

use embassy_executor::InterruptExecutor;
use firmware::stop;
use model::supervisor::Fault;

use super::interrupts::Interrupt;
use super::{time, uart};

/// Executor of the control task.
pub static HIGH: InterruptExecutor = InterruptExecutor::new();
/// Executor of all other tasks.
pub static LOW: InterruptExecutor = InterruptExecutor::new();

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
    // SAFETY: the interrupt is enabled by `HIGH.start`.
    unsafe { HIGH.on_interrupt() }
}

unsafe extern "C" fn low() {
    // SAFETY: the interrupt is enabled by `LOW.start`.
    unsafe { LOW.on_interrupt() }
}

/// Handles the watchdog's first zero. The second one resets the board; until then the fault is recorded.
#[unsafe(no_mangle)]
extern "C" fn NonMaskableInt() {
    stop::on_fresh_stack(Fault::Watchdog)
}

/// The interrupt table, which the linker places after the processor's exceptions.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [Handler; 32] = {
    let mut table: [Handler; 32] = [DefaultHandler; 32];
    table[Interrupt::Received as usize] = received;
    table[Interrupt::Sent as usize] = sent;
    table[Interrupt::Timer0 as usize] = timer_0;
    table[Interrupt::Timer1 as usize] = timer_1;
    table[Interrupt::High as usize] = high;
    table[Interrupt::Low as usize] = low;
    table
};
