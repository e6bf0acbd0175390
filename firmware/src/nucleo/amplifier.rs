//! The amplifier: DAC and enable out, monitors in.
//!
//! Assumed of the amplifier, to be changed with it: its voltage monitor gives 3.3 V at 1000 V, whatever its own range; its
//! current monitor gives 1.65 V without current and 3.3 V at 5 mA.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, AnyAdcChannel, SampleTime};
use embassy_stm32::dac::{DacChannel, Mode, Value};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac;
use embassy_stm32::peripherals::{ADC1, DAC1, PA0, PA1, PA4, PB5};
use model::Volts;
use model::supervisor::{Drive, Monitors};
use model::units::Signal;

use crate::board;

/// Number of the enable's pin on port B.
const ENABLE_PIN: usize = 5;
/// Volts of the spring for the whole range of the ADC. Not those of the DAC, which are the image's: a monitor on that scale
/// would agree with any amplifier. On its own it finds one of 1000 V behind an image for 700 V from 82 V on.
const MONITOR_SCALE_V: i32 = 1000;
/// Current in uA for half the range of the ADC.
const HALF_SCALE_UA: i32 = 5000;

/// DAC, enable and monitors.
pub struct Amplifier {
    dac: DacChannel<'static, Blocking>,
    enable: Output<'static>,
    adc: Adc<'static, ADC1>,
    voltage: AnyAdcChannel<'static, ADC1>,
    current: AnyAdcChannel<'static, ADC1>,
}

impl Amplifier {
    /// Zero volts before anything else; a pin that is not driven would float.
    pub fn new(
        dac: Peri<'static, DAC1>,
        output: Peri<'static, PA4>,
        enable: Peri<'static, PB5>,
        adc: Peri<'static, ADC1>,
        voltage: Peri<'static, PA0>,
        current: Peri<'static, PA1>,
    ) -> Self {
        let enable = Output::new(enable, Level::Low, Speed::Low);
        let mut dac = DacChannel::new_blocking(dac, output);
        // Behind the chip's buffer the first and the last 0.2 V would not come out: zero could be 6 % of the full scale.
        dac.set_mode(Mode::NormalExternalUnbuffered);
        dac.set(Value::Bit12Right(0));
        dac.enable();
        let adc = Adc::new(adc, AdcConfig::default());
        Self { dac, enable, adc, voltage: voltage.degrade_adc(), current: current.degrade_adc() }
    }
}

impl board::Amplifier for Amplifier {
    /// The code before the enable when it goes on, after it when it goes off: zero volts meet a closed switch.
    fn put(&mut self, drive: Drive) {
        if !drive.enabled() {
            self.enable.set_low();
        }
        self.dac.set(Value::Bit12Right(drive.code().0));
        if drive.enabled() {
            self.enable.set_high();
        }
    }

    /// 2 us of waiting for both conversions.
    fn monitors(&mut self) -> Option<Monitors> {
        let time = SampleTime::CYCLES24_5;
        let voltage = i32::from(self.adc.blocking_read(&mut self.voltage, time));
        let current = i32::from(self.adc.blocking_read(&mut self.current, time));
        // 12 bits times 1000 V, in 2^-20 V: 42 bits.
        let bits = (i64::from(voltage * MONITOR_SCALE_V) << 20) >> 12;
        Some(Monitors {
            voltage: Volts(Signal::from_bits(bits as i32)),
            current_ua: (current - 2048) * HALF_SCALE_UA / 2048,
        })
    }
}

/// Zero volts, amplifier off, by register: from any context, even with nothing set up (then the pins are not driven yet).
pub fn kill() {
    pac::GPIOB.bsrr().write(|w| w.set_br(ENABLE_PIN, true));
    pac::DAC1.dhr12r(0).write(|w| w.set_dhr(0));
}
