//! The emulated board: ARM's MPS2 with the FPGA image AN386, a Cortex-M4, as emulated by QEMU.
//!
//! | module | content |
//! | --- | --- |
//! | [`registers`] | Addresses of the registers in use. |
//! | [`interrupts`] | Numbers of the interrupts in use. |
//! | [`vectors`] | Interrupt handlers and executors. |
//! | [`time`] | Time driver on the two CMSDK timers. |
//! | [`dac`] | Amplifier port: every code is sent through a UART, where the host records it. |
//! | [`uart`] | Line to the host. |
//! | [`watchdog`] | The CMSDK watchdog: interrupt, then reset. |
//! | [`instructions`] | SysTick as a counter of instructions. |
//! | [`flash`] | Four pages for the store, saved in a file. |
//! | [`semihosting`] | Calls to the emulator: command line, files, exit. |

#![allow(unsafe_code)]

pub mod dac;
pub mod flash;
pub mod instructions;
pub mod interrupts;
pub mod registers;
pub mod semihosting;
pub mod time;
pub mod uart;
pub mod vectors;
pub mod watchdog;

use core::sync::atomic::{AtomicBool, Ordering};

use firmware::board::Board;

pub use dac::switch_amplifier_off;

/// State of the simulated safety circuit; initially open.
pub static INTERLOCK_CLOSED: AtomicBool = AtomicBool::new(false);

/// Hardware of the control task.
#[derive(Debug)]
pub struct Mps2 {
    dac: dac::Dac,
}

impl Mps2 {
    /// Initialises the hardware, the amplifier port first.
    pub fn init() -> Self {
        switch_amplifier_off();
        time::init();
        Self { dac: dac::Dac::default() }
    }
}

impl Mps2 {
    /// Starts the hardware watchdog, or changes its time: it interrupts after `reset_ms` without feeding, and resets after twice
    /// that time.
    pub fn start_watchdog(&mut self, reset_ms: u32) {
        watchdog::start(reset_ms);
    }
}

impl Board for Mps2 {
    type Amplifier = dac::Dac;

    fn amplifier(&mut self) -> &mut dac::Dac {
        &mut self.dac
    }

    fn interlock_closed(&mut self) -> bool {
        INTERLOCK_CLOSED.load(Ordering::Relaxed)
    }

    fn feed_watchdog(&mut self) {
        watchdog::feed();
    }
}
