//! Check of the image, and start of the guards against a stack overflow and a hanging control task.

use cortex_m::peripheral::Peripherals;
use model::supervisor::Fault;

use crate::{crash_record, hang_guard, image_check, log, stack_guard};

/// Checks the image, starts both guards and returns the core's peripherals; `core_hz` is the processor's clock, in Hz.
///
/// `None` if the flash does not contain the image that was built, or if the peripherals were taken before, so that the guards
/// cannot be set up: that is recorded as a `config` fault and logged, and the program must not start the control task. Nothing
/// feeds the watchdog then, so that the chip resets.
pub fn start(core_hz: u32) -> Option<Peripherals> {
    if !image_check::intact() {
        return refuse("image");
    }
    let Some(mut core) = Peripherals::take() else { return refuse("guards") };
    stack_guard::set(&mut core.MPU);
    hang_guard::start(&mut core.SYST, core_hz);
    Some(core)
}

fn refuse(field: &'static str) -> Option<Peripherals> {
    crash_record::add(Fault::Config);
    log::refused(field);
    None
}
