//! The board NUCLEO-G474RE: an STM32G474RE at 170 MHz. Its pins are in the table of the crate's page.
//!
//! The DAC's output buffer ends 0.2 V before either supply and is therefore off: PA4 is driven through the DAC's own resistance.
//! An amplifier with an input current needs a voltage follower at PA4: an input resistance of 1.5 MOhm reduces the voltage by
//! 1 %, one of 60 MOhm by one code.
//!
//! | module | content |
//! | --- | --- |
//! | [`clocks`] | Clock configuration, without a crystal. |
//! | [`amplifier`] | Amplifier port: DAC, enable, monitors. |
//! | [`uart`] | Line to the host. |
//! | [`flash`] | Four pages for the store. |
//! | [`reset`] | Source of the last reset. |
//! | [`random`] | Random number generator. |
//! | [`clock_test`] | Measurement of the processor's clock. |
//! | [`brown_out`] | Level of the brown-out reset. |
//! | `watchdog` | The chip's watchdog. |

pub mod amplifier;
pub mod brown_out;
pub mod clock_test;
pub mod clocks;
pub mod flash;
pub mod random;
pub mod reset;
pub mod uart;
mod watchdog;

use embassy_stm32::Peripherals;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use model::supervisor::Fault;

use crate::board::Board;
use crate::log;

pub use amplifier::switch_amplifier_off;
pub use reset::reset;

/// Hardware of the control task.
pub struct Nucleo {
    amplifier: amplifier::Amplifier,
    interlock: Input<'static>,
    watchdog: watchdog::Watchdog,
    led: Output<'static>,
    fault: Option<Fault>,
}

impl Nucleo {
    /// Initialises the hardware, the amplifier port first, and starts the watchdog: the chip is reset after `reset_ms` without
    /// feeding, until [`Nucleo::set_watchdog`]. The line to the host (`None` if it is in use already) and the flash are
    /// returned separately because other tasks own them.
    pub fn init(p: Peripherals, reset_ms: u32) -> (Self, Option<uart::Uart>, flash::Flash) {
        let amplifier = amplifier::Amplifier::new(p.DAC1, p.PA4, p.PB5, p.ADC1, p.PA0, p.PA1);
        let board = Self {
            amplifier,
            interlock: Input::new(p.PB10, Pull::Down),
            watchdog: watchdog::Watchdog::start(p.IWDG, reset_ms),
            led: Output::new(p.PA5, Level::Low, Speed::Low),
            fault: None,
        };
        (board, uart::Uart::new(p.LPUART1, p.PA3, p.PA2), flash::Flash::new(p.FLASH))
    }
}

impl Nucleo {
    /// Changes the time of the watchdog, in ms, from the next feeding on.
    pub fn set_watchdog(&mut self, reset_ms: u32) {
        self.watchdog.set(reset_ms);
    }

    /// Compares the processor's clock with the watchdog's: a wrong one is a `self-test` fault until the restart.
    pub fn test(&mut self) {
        if let Some(seen_hz) = clock_test::failed() {
            log::self_test("clock", seen_hz);
            self.fault = Some(Fault::SelfTest);
        }
    }
}

impl Board for Nucleo {
    type Amplifier = amplifier::Amplifier;

    fn amplifier(&mut self) -> &mut amplifier::Amplifier {
        &mut self.amplifier
    }

    fn interlock_closed(&mut self) -> bool {
        self.interlock.is_high()
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn fault(&self) -> Option<Fault> {
        self.fault
    }

    fn show_armed(&mut self, armed: bool) {
        self.led.set_level(armed.into());
    }
}
