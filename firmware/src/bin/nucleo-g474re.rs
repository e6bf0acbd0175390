//! The controller on the amplifier's MCU (STM32G474RE): one tick of the model every millisecond, its code to the
//! amplifier's input through DAC1 channel 1 (pin PA4).
//!
//! Nothing arms the output yet: until the supervisor exists, the target stays zero.

#![no_std]
#![no_main]
#![forbid(unsafe_code)]

use core::future::pending;

use defmt::{error, info};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::rcc::{Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk};
use embassy_time::{Duration, Ticker};
use model::{Input, OutOfRange, Settings, State, Volts};
use panic_probe as _;

/// Ticks per second.
const RATE_HZ: u32 = 1000;

/// The MCU at its full 170 MHz, from the internal oscillator: the board needs no crystal.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
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
    config
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_stm32::init(clocks());
    // First of all zero volts; a pin that is not driven would float.
    let mut dac = DacChannel::new_blocking(p.DAC1, p.PA4);
    dac.set(Value::Bit12Right(0));

    let config = match (Settings { rate_hz: f64::from(RATE_HZ), ..Settings::PAPER }).check() {
        Ok(config) => config,
        Err(OutOfRange { field, value, lowest, highest, unit }) => {
            error!("{} = {} is not allowed: expected {} to {} {}", field, value, lowest, highest, unit);
            // Returning would drop the DAC, and the pin would float.
            pending().await
        }
    };
    info!("up, {} ticks per second, not armed", RATE_HZ);

    let mut state = State::default();
    let mut ticker = Ticker::every(Duration::from_hz(u64::from(RATE_HZ)));
    let mut ticks: u32 = 0;
    loop {
        ticker.next().await;
        let output = config.tick(&mut state, Input { target: Volts::ZERO });
        dac.set(Value::Bit12Right(output.code.0));
        ticks = ticks.wrapping_add(1);
        if ticks.is_multiple_of(RATE_HZ) {
            info!("{} s, code {}", ticks / RATE_HZ, output.code.0);
        }
    }
}
