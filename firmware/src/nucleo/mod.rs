//! The real board: NUCLEO-G474RE, an STM32G474RE at 170 MHz.
//!
//! | pin | what it is |
//! | --- | --- |
//! | PA4 | DAC1 channel 1, the amplifier's input: 0 to 3.3 V for 0 V to its full scale, from up to 15 kOhm (unbuffered) |
//! | PB5 | amplifier's enable, high is on; a pull-down on the amplifier's side keeps it off while the chip is in reset |
//! | PB10 | interlock, high is closed; pulled down, so that a broken wire reads as open |
//! | PA0, PA1 | ADC1, the amplifier's voltage and current monitors |
//! | PA5 | LED, on while voltages may leave |
//! | PA2, PA3 | LPUART1, the host's line, 115 200 bit/s: the debugger's USB port |
//!
//! The DAC's buffer ends 0.2 V before either supply, so it is off, and nothing but its own resistance drives PA4. An
//! amplifier whose input takes current needs a follower at PA4: 1.5 MOhm cost 1 % of the voltage, 60 MOhm one code.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`clocks`] | 170 MHz without a crystal |
//! | [`amplifier`] | DAC, enable, monitors |
//! | [`uart`] | the host's line |
//! | [`flash`] | two pages for the store |
//! | [`reset`] | why the chip was reset |

pub mod amplifier;
pub mod clocks;
pub mod flash;
pub mod reset;
pub mod uart;

use embassy_stm32::Peripherals;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;

use crate::board::Board;

pub use amplifier::kill;
pub use reset::reset;

/// Without food for this long the chip is reset, in us.
const WATCHDOG_US: u32 = 100_000;

/// The board.
pub struct Nucleo {
    amplifier: amplifier::Amplifier,
    interlock: Input<'static>,
    watchdog: IndependentWatchdog<'static, IWDG>,
    led: Output<'static>,
}

impl Nucleo {
    /// Sets everything up, voltage first; the host's line and the flash apart, because another task owns them. `None`
    /// without a line.
    pub fn init(p: Peripherals) -> (Self, Option<uart::Uart>, flash::Flash) {
        let amplifier = amplifier::Amplifier::new(p.DAC1, p.PA4, p.PB5, p.ADC1, p.PA0, p.PA1);
        let mut watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_US);
        watchdog.unleash();
        let board = Self {
            amplifier,
            interlock: Input::new(p.PB10, Pull::Down),
            watchdog,
            led: Output::new(p.PA5, Level::Low, Speed::Low),
        };
        (board, uart::Uart::new(p.LPUART1, p.PA3, p.PA2), flash::Flash::new(p.FLASH))
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
        self.watchdog.pet();
    }

    fn show_armed(&mut self, armed: bool) {
        self.led.set_level(armed.into());
    }
}
