//! Emergency stop after a panic, a hard fault or an unexpected interrupt: the amplifier is switched off by register access
//! first, then the fault is recorded and logged, then the chip is reset.
//!
//! The next run starts in the faulted state and requires an acknowledgement and an arm command.

#![allow(unsafe_code)]

use core::panic::{Location, PanicInfo};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use model::supervisor::Fault;

use crate::{crash_record, log};

unsafe extern "Rust" {
    /// Sets 0 V and disables the amplifier by register access. Every board defines it; it must work in any context, even
    /// before any initialisation. It is resolved by the linker because a panic has no access to a board's value.
    safe fn switch_amplifier_off();
}

/// Low 32 bits of the number of ticks since boot, for the log of a fault.
pub static TICK: AtomicU32 = AtomicU32::new(0);

/// True from the first stop on: a failure during the stop only resets.
static STOPPING: AtomicBool = AtomicBool::new(false);

/// Switches the amplifier off, records and logs `fault` and, for a panic, its location, and resets.
pub fn stop(fault: Fault, panic: Option<&Location<'_>>) -> ! {
    cortex_m::interrupt::disable();
    switch_amplifier_off();
    if !STOPPING.swap(true, Ordering::Relaxed) {
        let tick = TICK.load(Ordering::Relaxed);
        crash_record::add(fault);
        log::fault(fault, tick);
        if let Some(location) = panic {
            log::panicked(location.file(), location.line());
        }
    }
    SCB::sys_reset()
}

/// Restarts on the host's request; the output is disabled already. A fault since the request stays recorded.
pub fn restart() -> ! {
    cortex_m::interrupt::disable();
    switch_amplifier_off();
    crash_record::record_restart();
    SCB::sys_reset()
}

/// Handles a panic. Inlined, so that the optimiser removes all panic messages, which nobody reads.
#[panic_handler]
#[expect(unused_attributes, reason = "it is not ignored when all crates are optimised together")]
#[inline(always)]
fn panic(info: &PanicInfo<'_>) -> ! {
    stop(Fault::Panic, info.location())
}

/// Handles a hard fault.
#[unsafe(naked)]
#[unsafe(export_name = "HardFault")]
unsafe extern "C" fn hard_fault() -> ! {
    core::arch::naked_asm!(
        "movs r0, #{fault}",
        "b {on}",
        fault = const Fault::HardFault.code(),
        on = sym on_fresh_stack
    )
}

/// Stops for `fault` from the top of the stack, because the stack may have overflowed. The float registers that the
/// processor has still to save on the old stack (FPCCR.LSPACT) are discarded: the first float instruction would otherwise
/// fault again.
#[unsafe(naked)]
pub extern "C" fn on_fresh_stack(fault: Fault) -> ! {
    core::arch::naked_asm!(
        "ldr r1, =_stack_start",
        "mov sp, r1",
        "ldr r1, =0xe000ef34",
        "ldr r2, [r1]",
        "bic r2, r2, #1",
        "str r2, [r1]",
        "dsb",
        "isb",
        "b {on}",
        on = sym stop_without_location
    )
}

extern "C" fn stop_without_location(fault: Fault) -> ! {
    stop(fault, None)
}

/// Handles an interrupt without a handler.
#[unsafe(export_name = "DefaultHandler")]
extern "C" fn unexpected() -> ! {
    on_fresh_stack(Fault::HardFault)
}
