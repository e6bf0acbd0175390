//! The image of the board NUCLEO-G474RE.

#![no_std]
#![no_main]

use core::future::pending;

use defmt_rtt as _;
use embassy_executor::InterruptExecutor;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use firmware::control::{Control, Untimed};
use firmware::host::{self, Host};
use firmware::isolation::Isolation;
use firmware::nucleo::uart::Uart;
use firmware::nucleo::{Nucleo, brown_out, clocks, random, reset, switch_amplifier_off};
use firmware::settings::BUILT_IN;
use firmware::store::Store;
use firmware::tasks::{self, Timing};
use firmware::{crash_record, guards, log, start};
use link::Server;
use model::supervisor::Fault;

/// Executor of the control task, on the interrupt of an unused peripheral.
static HIGH: InterruptExecutor = InterruptExecutor::new();
/// Executor of all other tasks, on the interrupt of an unused peripheral.
static LOW: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
unsafe fn CORDIC() {
    // SAFETY: the interrupt is enabled by `HIGH.start`.
    unsafe { HIGH.on_interrupt() }
}

#[interrupt]
unsafe fn FMAC() {
    // SAFETY: the interrupt is enabled by `LOW.start`.
    unsafe { LOW.on_interrupt() }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    switch_amplifier_off();
    let cause = crash_record::reset_cause(Some(reset()));
    // The watchdog is started with its built-in time, before anything stored is read.
    let reset_ms = BUILT_IN.watchdogs.reset_ms;
    let (mut board, line, flash) = Nucleo::init(embassy_stm32::init(clocks::config()), reset_ms);
    let mut store = Store::new(flash);
    let loaded = start::load(&store, &BUILT_IN);
    board.set_watchdog(loaded.settings.watchdogs.reset_ms);
    log::boot(cause.name, cause.fault.map_or(0, Fault::code), &loaded.settings);
    if guards::start(clocks::CORE_HZ).is_none() {
        // As after rejected settings: the output stays at zero and off until the watchdog resets the chip.
        loop {
            cortex_m::asm::wfi();
        }
    }
    board.test();
    interrupt::CORDIC.set_priority(Priority::P4);
    interrupt::LPUART1.set_priority(Priority::P8);
    interrupt::FMAC.set_priority(Priority::P12);
    let low = LOW.start(interrupt::FMAC);
    let high = HIGH.start(interrupt::CORDIC);
    let seed = random::seed();
    if seed.is_none() {
        log::refused("random");
    }
    match host::open(&loaded, &store, &cause, Some(brown_out::read()), seed.unwrap_or(0)) {
        // Impossible: this is the first call.
        Ok(None) => {}
        Ok(Some((control, isolation, server))) => {
            let run = run(board, control, isolation, Timing::of(&loaded.settings));
            if let (Ok(housekeeping), Ok(control)) = (housekeeping(), run) {
                low.spawn(housekeeping);
                high.spawn(control);
            }
            // Without a line the output cannot be enabled. Without a random number a recorded session could enable it.
            if let Some(talk) = line.filter(|_| seed.is_some()).and_then(|line| talk(line, server).ok()) {
                low.spawn(talk);
            }
        }
        // Nothing feeds the watchdog, so that the chip resets and logs this again, with its output at zero.
        Err(error) => {
            crash_record::add(Fault::Config);
            log::refused(error.field);
        }
    }
    loop {
        host::serve_store(&mut store, &loaded.settings);
        cortex_m::asm::wfi();
    }
}

#[embassy_executor::task]
async fn run(mut board: Nucleo, control: &'static mut Control, isolation: &'static mut Isolation, timing: Timing) {
    let mut host = Host::new(control);
    tasks::control(&mut board, control, isolation, &mut host, &mut Untimed, timing).await;
    // Returning would drop the DAC, and its pin would float.
    pending().await
}

#[embassy_executor::task]
async fn talk(mut line: Uart, server: &'static mut Server) {
    host::talk(&mut line, server).await
}

#[embassy_executor::task]
async fn housekeeping() {
    tasks::housekeeping(|_| ()).await
}
