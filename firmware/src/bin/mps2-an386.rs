//! The image of the emulated board: plays the script that the emulator's command line names, then ends the emulator.

#![no_std]
#![no_main]

use cortex_m::peripheral::Peripherals;
use defmt_semihosting as _;
use firmware::control::Control;
use firmware::log::{self, Done, Event};
use firmware::mps2::actor::{self, Actor};
use firmware::mps2::instructions::Counter;
use firmware::mps2::vectors::{HIGH, LOW, Line};
use firmware::mps2::{Mps2, reset_cause, semihosting};
use firmware::script::{SETTINGS, SUPERVISION, Script};
use firmware::{stack_guard, tasks};

use core::sync::atomic::Ordering;

/// The emulator was not told a script.
const EXIT_NO_SCRIPT: u32 = 2;

#[cortex_m_rt::entry]
fn main() -> ! {
    let board = Mps2::init();
    let (reset, last_fault) = reset_cause();
    log::boot(reset, last_fault.map_or(0, |fault| fault.code()));

    let mut buffer = [0; 64];
    let script = match (last_fault, Script::parse(semihosting::command_line(&mut buffer))) {
        (Some(_), _) => Script::Aftermath,
        (None, Some(script)) => script,
        (None, None) => semihosting::exit(EXIT_NO_SCRIPT),
    };
    let control = match Control::new(&SETTINGS, &SUPERVISION, last_fault) {
        Ok(control) => control,
        Err(error) => {
            log::refused(error.field);
            semihosting::exit(1)
        }
    };

    if let Some(mut core) = Peripherals::take() {
        stack_guard::set(&mut core.MPU);
        // SAFETY: before they are enabled. The smaller, the more urgent: the alarm wakes the control task, and that one
        // interrupts all else.
        unsafe {
            core.NVIC.set_priority(Line::Timer0, 0x20);
            core.NVIC.set_priority(Line::Timer1, 0x20);
            core.NVIC.set_priority(Line::High, 0x40);
            core.NVIC.set_priority(Line::Low, 0xc0);
        }
    }
    let low = LOW.start(Line::Low);
    let high = HIGH.start(Line::High);
    if let (Ok(housekeeping), Ok(control)) = (housekeeping(), run(board, control, script)) {
        low.spawn(housekeeping);
        high.spawn(control);
    }
    loop {
        cortex_m::asm::wfi();
    }
}

#[embassy_executor::task]
async fn run(mut board: Mps2, mut control: Control, script: Script) {
    let mut actor = Actor::new(script);
    let mut counter = Counter::begin();
    let (ticks, missed) = tasks::control(&mut board, &mut control, &mut actor, &mut counter).await;
    let (digest, instructions) = (actor.digest(), counter.instructions());
    log::queue(Event::Done(Done { ticks, missed, digest, instructions }));
}

#[embassy_executor::task]
async fn housekeeping() {
    tasks::housekeeping(|event| {
        if matches!(event, Some(Event::Done(_))) {
            semihosting::exit(0);
        }
        if actor::STALL.load(Ordering::Relaxed) {
            actor::hang();
        }
    })
    .await
}
