//! The emulated board: ARM's MPS2 with the AN386 image, a Cortex-M4, as QEMU has it.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`registers`] | the addresses in use |
//! | [`vectors`] | the interrupts in use |
//! | [`time`] | time driver on the two CMSDK timers |
//! | [`dac`] | amplifier port: every code goes out through a UART, so that the host sees each of them |
//! | [`uart`] | the host's line |
//! | [`watchdog`] | the CMSDK watchdog: interrupt, then reset |
//! | [`instructions`] | SysTick as a counter of instructions |
//! | [`actor`] | plays a script: orders, interlock, mishaps |
//! | [`flash`] | two pages for the store, kept in a file |
//! | [`semihosting`] | which script, files, and the way out |

#![allow(unsafe_code)]

pub mod actor;
pub mod dac;
pub mod flash;
pub mod instructions;
pub mod registers;
pub mod semihosting;
pub mod time;
pub mod uart;
pub mod vectors;
pub mod watchdog;

use core::sync::atomic::{AtomicBool, Ordering};

use crate::board::Board;

pub use dac::kill;

/// What the script does to the safety circuit; open until it says otherwise.
pub static INTERLOCK_CLOSED: AtomicBool = AtomicBool::new(false);

/// The board.
#[derive(Debug)]
pub struct Mps2 {
    dac: dac::Dac,
}

impl Mps2 {
    /// Sets everything up, voltage first.
    pub fn init() -> Self {
        kill();
        time::init();
        watchdog::init();
        Self { dac: dac::Dac::default() }
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
