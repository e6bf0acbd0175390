//! Start of the guards against a stack overflow and a hanging control task.

use cortex_m::peripheral::Peripherals;
use model::supervisor::Fault;

use crate::{crash_record, hang_guard, log, stack_guard};

/// Starts both guards and returns the core's peripherals; `core_hz` is the processor's clock, in Hz.
///
/// `None` if the peripherals were taken before, so that the guards cannot be set up: that is recorded as a `config` fault and
/// logged, and the program must not start the control task. Nothing feeds the watchdog then, so that the chip resets.
pub fn start(core_hz: u32) -> Option<Peripherals> {
    let Some(mut core) = Peripherals::take() else {
        crash_record::add(Fault::Config);
        log::refused("guards");
        return None;
    };
    stack_guard::set(&mut core.MPU);
    hang_guard::start(&mut core.SYST, core_hz);
    Some(core)
}
