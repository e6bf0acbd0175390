//! The image of the emulated board. It executes the script that the emulator's command line names, then ends the emulator. With
//! the name `link` it executes the commands of a host at its UART until the emulator is ended, with its interlock closed.

#![no_std]
#![no_main]

use cortex_m::peripheral::Peripherals;
use defmt_semihosting as _;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use firmware::board::Board;
use firmware::control::{Control, Untimed};
use firmware::host::{self, Host};
use firmware::isolation::Isolation;
use firmware::settings::{BUILT_IN, built_in};
use firmware::start::{self, Loaded};
use firmware::store::Store;
use firmware::tasks::{self, Timing};
use firmware::{crash_record, guards, log};
use link::Server;
use model::supervisor::Fault;
use test_bench::mps2::flash::Flash;
use test_bench::mps2::instructions::{Counter, Instructions};
use test_bench::mps2::interrupts::Interrupt;
use test_bench::mps2::registers::CLOCK_HZ;
use test_bench::mps2::uart::Uart;
use test_bench::mps2::vectors::{HIGH, LOW};
use test_bench::mps2::{INTERLOCK_CLOSED, Mps2, semihosting};
use test_bench::player::{self, Player};
use test_bench::script::{FaultInjection, Script};

use core::arch::asm;
use core::sync::atomic::Ordering;

/// Exit code: the command line does not name a script.
const EXIT_NO_SCRIPT: u32 = 2;
/// Exit code: there is no simulated spring in the emulator's folder.
const EXIT_NO_SPRING: u32 = 5;
/// Name of the run with the commands of a host.
const LINK: &str = "link";

/// Result of a script, from the control task to the housekeeping task.
static DONE: Signal<CriticalSectionRawMutex, Done> = Signal::new();

/// Result of a script.
struct Done {
    /// Number of executed ticks.
    ticks: u32,
    /// Number of missed ticks.
    missed: u32,
    /// Digest of every DAC code and every estimate.
    digest: u64,
    /// Instructions of the model's tick.
    instructions: Instructions,
}

/// Source of the commands.
#[derive(PartialEq)]
enum Mode {
    Play(Script),
    Link,
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut board = Mps2::init();
    board.start_watchdog(BUILT_IN.watchdogs.reset_ms);
    let cause = crash_record::reset_cause(None);

    let mut buffer = [0; 64];
    let name = semihosting::command_line(&mut buffer);
    let mode = match (cause.fault, Script::parse(name)) {
        _ if name.trim_ascii() == LINK => Mode::Link,
        (Some(_), _) => Mode::Play(Script::Aftermath),
        (None, Some(script)) => Mode::Play(script),
        (None, None) => semihosting::exit(EXIT_NO_SCRIPT),
    };
    let mut store = Store::new(Flash::init());
    let loaded = match &mode {
        // A script has its own settings, whatever is stored.
        Mode::Play(script) => Loaded::fixed(built_in(*script.settings())),
        Mode::Link => start::load(&store, &BUILT_IN),
    };
    board.start_watchdog(loaded.settings.watchdogs.reset_ms);
    log::boot(cause.name, cause.fault.map_or(0, Fault::code), &loaded.settings);
    if matches!(mode, Mode::Play(Script::UpDown(_))) && !board.amplifier().connect() {
        semihosting::exit(EXIT_NO_SPRING);
    }
    let (control, isolation, server) = match host::open(&loaded, &store, &cause, None, semihosting::seed()) {
        Ok(Some(built)) => built,
        Ok(None) => semihosting::exit(1),
        Err(error) => {
            log::refused(error.field);
            semihosting::exit(1)
        }
    };
    // At about a tenth of the real board's speed, what is built above and the check of the image below take more than one period.
    board.feed_watchdog();

    if mode == Mode::Play(Script::Drill(FaultInjection::Unguarded)) {
        let _taken = Peripherals::take();
    }
    let Some(mut core) = guards::start(CLOCK_HZ) else {
        loop {
            cortex_m::asm::wfi();
        }
    };
    // A smaller number is a higher priority: the alarm wakes the control task, which preempts everything else.
    for (interrupt, priority) in [
        (Interrupt::Timer0, 0x20),
        (Interrupt::Timer1, 0x20),
        (Interrupt::High, 0x40),
        (Interrupt::Received, 0x80),
        (Interrupt::Sent, 0x80),
        (Interrupt::Low, 0xc0),
    ] {
        // SAFETY: the interrupts are not enabled yet.
        unsafe { core.NVIC.set_priority(interrupt, priority) };
    }
    let timing = Timing::of(&loaded.settings);
    let low = LOW.start(Interrupt::Low);
    let high = HIGH.start(Interrupt::High);
    if let Ok(housekeeping) = housekeeping() {
        low.spawn(housekeeping);
    }
    match mode {
        Mode::Play(script) => {
            let timing = timing.counted_from(script.first_tick());
            if let Ok(control) = play(board, control, isolation, script, timing) {
                high.spawn(control);
            }
        }
        Mode::Link => {
            INTERLOCK_CLOSED.store(true, Ordering::Relaxed);
            if let (Ok(talk), Ok(control)) = (talk(server), obey(board, control, isolation, timing)) {
                low.spawn(talk);
                high.spawn(control);
            }
            // Without sleeping: while the processor sleeps, the emulator's clock can follow the real one and skip ticks; while it
            // runs, the instructions alone determine the time.
            loop {
                host::serve_store(&mut store, &loaded.settings);
            }
        }
    }
    idle()
}

/// Waits for interrupts without sleeping. To put the processor to sleep and wake it up again takes the emulator longer than a tick: it
/// changes threads. Instructions without effect, in a block that it translates once, take next to no time.
fn idle() -> ! {
    loop {
        // SAFETY: the instructions have no effect.
        unsafe { asm!(".rept 60", "nop", ".endr", options(nomem, nostack, preserves_flags)) }
    }
}

#[embassy_executor::task]
async fn play(
    mut board: Mps2,
    control: &'static mut Control,
    isolation: &'static mut Isolation,
    script: Script,
    timing: Timing,
) {
    let mut player = Player::new(script);
    let mut counter = Counter::begin();
    let (ticks, missed) = tasks::control(&mut board, control, isolation, &mut player, &mut counter, timing).await;
    DONE.signal(Done { ticks: ticks as u32, missed, digest: player.digest(), instructions: counter.instructions() });
}

#[embassy_executor::task]
async fn obey(mut board: Mps2, control: &'static mut Control, isolation: &'static mut Isolation, timing: Timing) {
    let mut host = Host::new(control);
    tasks::control(&mut board, control, isolation, &mut host, &mut Untimed, timing).await;
}

#[embassy_executor::task]
async fn talk(server: &'static mut Server) {
    host::talk(&mut Uart::init(), server).await
}

#[embassy_executor::task]
async fn housekeeping() {
    tasks::housekeeping(|event| {
        // Once all events are logged.
        if event.is_none()
            && let Some(Done { ticks, missed, digest, instructions: Instructions { min, mean, max } }) = DONE.try_take()
        {
            defmt::info!(
                "done ticks={=u32} missed={=u32} digest={=u64:x} min={=u32} mean={=u32} max={=u32}",
                ticks,
                missed,
                digest,
                min,
                mean,
                max
            );
            semihosting::exit(0);
        }
        if player::STALL.load(Ordering::Relaxed) {
            player::hang();
        }
    })
    .await
}
