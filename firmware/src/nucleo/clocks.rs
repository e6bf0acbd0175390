//! The MCU at its full 170 MHz, from the internal oscillator: the board needs no crystal.

use embassy_stm32::Config;
use embassy_stm32::rcc::{Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux};

/// Clock of the processor, in Hz: HSI 16 MHz / 4 * 85 / 2.
pub const CORE_HZ: u32 = 170_000_000;

/// Configuration for `embassy_stm32::init`.
pub fn config() -> Config {
    let mut config = Config::default();
    config.rcc.pll = Some(Pll {
        source: PllSource::HSI,
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    // Needed above 150 MHz.
    config.rcc.boost = true;
    config.rcc.mux.adc12sel = mux::Adcsel::SYS;
    config
}
