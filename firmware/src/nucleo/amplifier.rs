//! The amplifier port: DAC and enable as outputs, voltage and current monitors as inputs.
//!
//! Assumptions about the amplifier, to be adapted to the real one: the voltage monitor gives 3.3 V at 1000 V, independent of the
//! amplifier's range; the current monitor gives 1.65 V at 0 mA and 3.3 V at 5 mA.

// For the name under which the linker finds the emergency stop.
#![allow(unsafe_code)]

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, AnyAdcChannel, SampleTime, VrefInt};
use embassy_stm32::dac::{DacChannel, Mode, Value};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac;
use embassy_stm32::peripherals::{ADC1, DAC1, PA0, PA1, PA4, PB5};
use model::Volts;
use model::supervisor::{Drive, Monitors};
use model::units::Signal;

use crate::board;

/// Number of the enable pin on port B.
const ENABLE_PIN: usize = 5;
/// Amplifier voltage at the full scale of the ADC, in V. It differs from the DAC's scale, which depends on the image: on that
/// scale the monitor would agree with any amplifier. With a scale of its own it detects an amplifier for 1000 V behind an image
/// for 700 V from 82 V on.
const MONITOR_SCALE_V: i32 = 1000;
/// Supply at which the manufacturer has measured the reference, in mV.
const CALIBRATED_MV: u32 = 3000;
/// Current at half of the ADC's range, in uA.
const HALF_SCALE_UA: i32 = 5000;

/// The amplifier port.
pub struct Amplifier {
    dac: DacChannel<'static, Blocking>,
    enable: Output<'static>,
    adc: Adc<'static, ADC1>,
    voltage: AnyAdcChannel<'static, ADC1>,
    current: AnyAdcChannel<'static, ADC1>,
    reference: VrefInt,
    /// Reading of the reference at the supply [`CALIBRATED_MV`], measured by the chip's manufacturer.
    calibrated: u16,
}

impl Amplifier {
    /// Initialises the port with 0 V and the output disabled.
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
        // The chip's buffer does not reach the first and the last 0.2 V: zero could be 6 % of the full scale.
        dac.set_mode(Mode::NormalExternalUnbuffered);
        dac.set(Value::Bit12Right(0));
        dac.enable();
        let adc = Adc::new(adc, AdcConfig::default());
        let reference = adc.enable_vrefint();
        let (voltage, current) = (voltage.degrade_adc(), current.degrade_adc());
        Self { dac, enable, adc, voltage, current, reference, calibrated: pac::VREFINTCAL.data().read() }
    }
}

impl board::Amplifier for Amplifier {
    /// Writes the code before switching the enable on, and after switching it off.
    fn put(&mut self, drive: Drive) {
        if !drive.enabled() {
            self.enable.set_low();
        }
        self.dac.set(Value::Bit12Right(drive.code().0));
        if drive.enabled() {
            self.enable.set_high();
        }
    }

    /// Blocks for 8 us during the three conversions.
    fn monitors(&mut self) -> Option<Monitors> {
        let time = SampleTime::CYCLES24_5;
        let voltage = i32::from(self.adc.blocking_read(&mut self.voltage, time));
        let current = i32::from(self.adc.blocking_read(&mut self.current, time));
        // The reference needs 4 us to be sampled.
        let reference = u32::from(self.adc.blocking_read(&mut self.reference, SampleTime::CYCLES247_5));
        // DAC and ADC share one supply: what it adds to the output, it takes from the voltage monitor's reading.
        let supply_mv = CALIBRATED_MV * u32::from(self.calibrated) / reference.max(1);
        // 12 bits times 1000 V, in 2^-20 V: 42 bits.
        let bits = (i64::from(voltage * MONITOR_SCALE_V) << 20) >> 12;
        Some(Monitors {
            voltage: Volts(Signal::from_bits(bits as i32)),
            current_ua: (current - 2048) * HALF_SCALE_UA / 2048,
            supply_mv: Some(supply_mv.min(u32::from(u16::MAX)) as u16),
        })
    }
}

/// Sets 0 V and disables the amplifier by register access, in any context. Before the initialisation of the pins they are not
/// driven, and the registers have no effect.
#[unsafe(no_mangle)]
pub fn switch_amplifier_off() {
    pac::GPIOB.bsrr().write(|w| w.set_br(ENABLE_PIN, true));
    pac::DAC1.dhr12r(0).write(|w| w.set_dhr(0));
}
