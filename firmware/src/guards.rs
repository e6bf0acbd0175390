//! Result of the RAM's test, check of the image, and start of the guards against a stack overflow and a hanging control task.

use cortex_m::peripheral::Peripherals;
use model::supervisor::Fault;

use crate::{crash_record, hang_guard, image_check, log, ram_test, stack_guard};

/// Checks RAM and image, starts both guards and returns the core's peripherals; `core_hz` is the processor's clock, in Hz.
///
/// `None` if a word of the RAM has failed its test (a `self-test` fault), if the flash does not contain the image that was built,
/// or if the peripherals were taken before, so that the guards cannot be set up (`config` faults). That is recorded and logged,
/// and the program must not start the control task. Nothing feeds the watchdog then, so that the chip resets.
pub fn start(core_hz: u32) -> Option<Peripherals> {
    if let Some(address) = ram_test::failed() {
        crash_record::add(Fault::SelfTest);
        log::self_test("ram", address);
        return None;
    }
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
