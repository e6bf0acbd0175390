//! Panic, hard fault, unexpected interrupt: voltage off by register first, then last words, log, reset.
//!
//! The next run starts faulted and needs an acknowledgement and an arm command.

#![allow(unsafe_code)]

use core::panic::{Location, PanicInfo};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use model::supervisor::Fault;

#[cfg(feature = "mps2-an386")]
use crate::mps2 as board;
#[cfg(feature = "nucleo-g474re")]
use crate::nucleo as board;
use crate::{last_words, log};

/// Ticks since boot, for the log of a fault.
pub static TICK: AtomicU32 = AtomicU32::new(0);

/// Set by the first who stops: what fails while stopping must not stop again, only reset.
static STOPPING: AtomicBool = AtomicBool::new(false);

/// Takes the voltage away and resets.
pub fn stop(fault: Fault, panic: Option<&Location<'_>>) -> ! {
    cortex_m::interrupt::disable();
    board::kill();
    if !STOPPING.swap(true, Ordering::Relaxed) {
        let tick = TICK.load(Ordering::Relaxed);
        last_words::leave(fault, tick);
        log::fault(fault, tick);
        if let Some(location) = panic {
            log::panicked(location.file(), location.line());
        }
    }
    SCB::sys_reset()
}

/// Restarts because it was told to, while no voltage may leave.
pub fn restart() -> ! {
    cortex_m::interrupt::disable();
    board::kill();
    last_words::leave_in_order();
    SCB::sys_reset()
}

/// Inlined, so that the optimiser sees that nobody reads the message, and leaves all messages out of the image.
#[panic_handler]
#[expect(unused_attributes, reason = "it is not ignored when all crates are optimised at once")]
#[inline(always)]
fn panic(info: &PanicInfo<'_>) -> ! {
    stop(Fault::Panic, info.location())
}

/// The processor stopped the program.
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

/// Stops for `fault`, from the top of the stack: when it ran out there is none left to stand on. Nothing
/// returns to the old one, so the float registers that the processor still means to save there (FPCCR.LSPACT) are given up:
/// the first float instruction would fault again.
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
        on = sym stop_there
    )
}

extern "C" fn stop_there(fault: Fault) -> ! {
    stop(fault, None)
}

/// An interrupt that nobody enabled.
#[unsafe(export_name = "DefaultHandler")]
extern "C" fn unexpected() -> ! {
    on_fresh_stack(Fault::HardFault)
}
