//! The image of the emulated board: plays the script that the emulator's command line names, then ends the emulator. Named
//! `link` instead, it obeys a host on its UART until the emulator is ended, its interlock closed.

#![no_std]
#![no_main]

use cortex_m::peripheral::Peripherals;
use defmt_semihosting as _;
use firmware::board::Board;
use firmware::control::{Control, Untimed};
use firmware::host::{self, Host};
use firmware::log::{self, Done, Event};
use firmware::mps2::actor::{self, Actor};
use firmware::mps2::flash::Flash;
use firmware::mps2::instructions::Counter;
use firmware::mps2::registers::CLOCK_HZ;
use firmware::mps2::uart::Uart;
use firmware::mps2::vectors::{HIGH, LOW, Line};
use firmware::mps2::{INTERLOCK_CLOSED, Mps2, semihosting};
use firmware::script::Script;
use firmware::settings::FLASHED;
use firmware::store::Store;
use firmware::{hang_guard, last_words, stack_guard, tasks};
use link::{Controller, Desk};

use core::sync::atomic::Ordering;

/// The emulator was not told a script.
const EXIT_NO_SCRIPT: u32 = 2;
/// There is no spring in the emulator's folder.
const EXIT_NO_SPRING: u32 = 5;
/// Name of the run that a host commands.
const LINK: &str = "link";

/// Who commands.
enum Mode {
    Play(Script),
    Link,
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut board = Mps2::init();
    let (reset, last_fault) = last_words::reset_cause(None);

    let mut buffer = [0; 64];
    let name = semihosting::command_line(&mut buffer);
    let mode = match (last_fault, Script::parse(name)) {
        _ if name.trim() == LINK => Mode::Link,
        (Some(_), _) => Mode::Play(Script::Aftermath),
        (None, Some(script)) => Mode::Play(script),
        (None, None) => semihosting::exit(EXIT_NO_SCRIPT),
    };
    let settings = match &mode {
        Mode::Play(script) => script.settings(),
        Mode::Link => &FLASHED,
    };
    let controller = Controller::of(&settings.compensation);
    log::boot(reset, last_fault.map_or(0, |fault| fault.code()), controller);
    if matches!(mode, Mode::Play(Script::UpDown(_))) && !board.amplifier().connect() {
        semihosting::exit(EXIT_NO_SPRING);
    }
    let mut store = Store::new(Flash::init());
    let (control, desk) = match host::open(settings, &store, last_fault) {
        Ok(Some(both)) => both,
        Ok(None) => semihosting::exit(1),
        Err(error) => {
            log::refused(error.field);
            semihosting::exit(1)
        }
    };

    if let Some(mut core) = Peripherals::take() {
        stack_guard::set(&mut core.MPU);
        hang_guard::start(&mut core.SYST, CLOCK_HZ);
        // SAFETY: before they are enabled. The smaller, the more urgent: the alarm wakes the control task, and that one
        // interrupts all else.
        unsafe {
            core.NVIC.set_priority(Line::Timer0, 0x20);
            core.NVIC.set_priority(Line::Timer1, 0x20);
            core.NVIC.set_priority(Line::High, 0x40);
            core.NVIC.set_priority(Line::Received, 0x80);
            core.NVIC.set_priority(Line::Sent, 0x80);
            core.NVIC.set_priority(Line::Low, 0xc0);
        }
    }
    let low = LOW.start(Line::Low);
    let high = HIGH.start(Line::High);
    if let Ok(housekeeping) = housekeeping() {
        low.spawn(housekeeping);
    }
    match mode {
        Mode::Play(script) => {
            if let Ok(control) = play(board, control, script) {
                high.spawn(control);
            }
        }
        Mode::Link => {
            INTERLOCK_CLOSED.store(true, Ordering::Relaxed);
            if let (Ok(talk), Ok(control)) = (talk(desk), obey(board, control)) {
                low.spawn(talk);
                high.spawn(control);
            }
            // Never asleep: while the processor sleeps the emulator's clock may jump with ours, over ticks; while it runs,
            // instructions alone make the time.
            loop {
                host::keep(&mut store);
            }
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}

#[embassy_executor::task]
async fn play(mut board: Mps2, control: &'static mut Control, script: Script) {
    let mut actor = Actor::new(script);
    let mut counter = Counter::begin();
    let (ticks, missed) = tasks::control(&mut board, control, &mut actor, &mut counter).await;
    let (digest, instructions) = (actor.digest(), counter.instructions());
    log::queue(Event::Done(Done { ticks, missed, digest, instructions }));
}

#[embassy_executor::task]
async fn obey(mut board: Mps2, control: &'static mut Control) {
    let mut host = Host::new(control);
    tasks::control(&mut board, control, &mut host, &mut Untimed).await;
}

#[embassy_executor::task]
async fn talk(desk: &'static mut Desk) {
    host::talk(&mut Uart::init(), desk).await
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
