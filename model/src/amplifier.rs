//! The amplifier stage: the part of a wanted voltage that really reaches the spring.
//!
//! Important terms:
//!
//! - *wanted voltage*: the output of the pre-compensator, in V, before any limit.
//! - *slew*: the fastest change of the voltage, in V/s.
//! - *range*: the lowest and the highest voltage that may be put out, in V.
//! - *code*: the number written to the DAC. Code `n` of a `b`-bit converter stands for `n * full_scale / (2^b - 1)`.
//! - *applied voltage*: the voltage of the code, in V, which is what the spring sees.
//!
//! Each tick limits the slew, then the range, then rounds to the nearest code. The range wins over the slew, because it
//! protects the spring. The voltage before rounding is kept between ticks, and the part of a slew step below a signal's
//! resolution is carried over, so that the slowest slew still moves at its own rate.
//!
//! The ends of the range are moved inward to the next code, so that rounding cannot leave the range.

use fixed::types::I3F29;

use crate::error::OutOfRange;
use crate::units::{Accumulator, DacCode, SampleTime, Signal, Volts, accumulator, rarely, signal};
use crate::validated::{Validate, Validated};

/// An amplifier and its digital-to-analog converter, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplifier {
    /// Voltage at the highest code, 50 to 1000 V.
    pub full_scale_v: f64,
    /// Lowest voltage that may be put out, 0 V to 10 V below `full_scale_v`.
    pub min_v: f64,
    /// Highest voltage that may be put out, `min_v` + 10 V to `full_scale_v`.
    pub max_v: f64,
    /// Fastest change of the voltage, 1 to 1e9 V/s; `None` if it is not limited.
    pub slew_v_per_s: Option<f64>,
    /// Width of the converter, 8 to 16 bits.
    pub dac_bits: u32,
}

impl Amplifier {
    /// The source report's range: 0 to 700 V, from the 12-bit converter of the MCU.
    pub const PAPER: Self = Self::up_to(700.0);

    /// Largest `full_scale_v` of any amplifier, in V.
    pub const MOST_V: f64 = 1000.0;

    /// Returns an amplifier of 0 V to `full_scale_v` behind a 12-bit converter, without a slew limit.
    pub const fn up_to(full_scale_v: f64) -> Self {
        Self { full_scale_v, min_v: 0.0, max_v: full_scale_v, slew_v_per_s: None, dac_bits: 12 }
    }

    /// Returns this amplifier with the stricter of its own and the given limits: the highest voltage in V and the slew
    /// in V/s. A limit of NaN stays NaN, which [`Validate::check`] rejects.
    pub fn limited_to(self, limit_v: Option<f64>, slew_v_per_s: Option<f64>) -> Self {
        // `f64::min` would ignore NaN.
        let stricter = |own: f64, other: f64| if other > own { own } else { other };
        Self {
            max_v: limit_v.map_or(self.max_v, |limit| stricter(self.max_v, limit)),
            slew_v_per_s: [self.slew_v_per_s, slew_v_per_s].into_iter().flatten().reduce(stricter),
            ..self
        }
    }

    /// Returns the largest change of the voltage in one tick, in V; `None` if a tick is long enough for any change.
    pub(crate) fn slew_per_tick_v(&self, sample_time: SampleTime) -> Option<f64> {
        self.slew_v_per_s.map(|slew| slew * sample_time.seconds()).filter(|step_v| *step_v < self.full_scale_v)
    }

    /// Returns the voltage between two neighbouring codes, in V.
    pub fn volts_per_code(&self) -> f64 {
        self.full_scale_v / f64::from((1u32 << self.dac_bits) - 1)
    }
}

impl Validate for Amplifier {
    fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        let Self { full_scale_v, min_v, max_v, slew_v_per_s, dac_bits } = *self;
        OutOfRange::check("full_scale_v", full_scale_v, 50.0..=Self::MOST_V, "V")?;
        OutOfRange::check("dac_bits", f64::from(dac_bits), 8.0..=16.0, "bits")?;
        OutOfRange::check("min_v", min_v, 0.0..=full_scale_v - 10.0, "V")?;
        OutOfRange::check("max_v", max_v, min_v + 10.0..=full_scale_v, "V")?;
        OutOfRange::check("slew_v_per_s", slew_v_per_s.unwrap_or(1e9), 1.0..=1e9, "V/s")
    }
}

/// The amplifier for one sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    lowest: Signal,
    highest: Signal,
    /// The limit to report when a change was held back: none if a tick is long enough for any change.
    slew: Limits,
    step: Accumulator,
    codes_per_volt: Signal,
    volts_per_code: I3F29,
}

/// The voltage at the amplifier's input after the limits, before rounding to a code; the default is 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    voltage: Signal,
    /// Part of the last slew step below a signal's resolution, in 2^-52 V.
    carried: u32,
}

/// Output of the amplifier stage at one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    /// Voltage after slew and range, before rounding to a code.
    pub voltage: Volts,
    /// Code to be written to the DAC.
    pub code: DacCode,
    /// Voltage across the spring while `code` is written.
    pub applied: Volts,
    /// Limits that held the voltage back.
    pub limits: Limits,
}

/// Set of the limits that acted in one tick; usually empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits(u8);

impl Limits {
    /// No limit acted.
    pub const NONE: Self = Self(0);
    /// The voltage was held at the upper end of the range.
    pub const UPPER: Self = Self(1);
    /// The voltage was held at the lower end of the range.
    pub const LOWER: Self = Self(2);
    /// The change of the voltage was held to `slew_v_per_s`.
    pub const SLEW: Self = Self(4);
    /// The target itself was outside the range and was moved to its end.
    pub const TARGET: Self = Self(8);

    /// Returns true if at least one limit is in both sets.
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Returns the set as one byte for logs and telemetry: upper 1, lower 2, slew 4, target 8.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Returns the union of both sets.
    #[inline(always)]
    pub(crate) const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Returns `value` moved into the range from `lowest` to `highest`, and adds `below` or `above` to the set if it had to be moved.
    #[inline(always)]
    fn hold(&mut self, mut value: Signal, (lowest, highest): (Signal, Signal), (below, above): (Self, Self)) -> Signal {
        if value < lowest {
            value = rarely(lowest);
            *self = self.with(below);
        }
        if value > highest {
            value = rarely(highest);
            *self = self.with(above);
        }
        value
    }
}

impl Validated<'_, Amplifier> {
    /// Quantizes the amplifier for the tick.
    pub fn quantize(self) -> Config {
        let amplifier = self.settings();
        let step_v = amplifier.slew_per_tick_v(self.sample_time());
        let unit = amplifier.volts_per_code();
        let mut config = Config {
            lowest: Signal::ZERO,
            highest: Signal::ZERO,
            slew: if step_v.is_some() { Limits::SLEW } else { Limits::NONE },
            // 1 V more than any change inside the range, so that a voltage beyond its end is seen to be held there.
            step: accumulator(step_v.unwrap_or(amplifier.full_scale_v + 1.0)),
            codes_per_volt: signal(1.0 / unit),
            // Rounded down: the highest code never stands for more than the full scale.
            volts_per_code: I3F29::from_bits((unit * f64::from(1 << 29)) as i32),
        };
        // Rounded inward, with a tolerance so that an end which is the voltage of a code keeps that code.
        let tolerance = 1e-9;
        config.lowest = config.volts(DacCode((amplifier.min_v / unit + (1.0 - tolerance)) as u16)).0;
        config.highest = config.volts(DacCode((amplifier.max_v / unit + tolerance) as u16)).0;
        config
    }
}

impl Config {
    /// Limits the wanted voltage, rounds it to a code, and advances the state by one tick. `limits` are those that have acted before.
    #[inline(always)]
    pub(crate) fn drive(&self, state: &mut State, wanted: Volts, mut limits: Limits) -> Drive {
        let step = self.step.to_bits() + i64::from(state.carried);
        state.carried = step as u32;
        let step = Signal::from_bits((step >> 32) as i32);
        let reachable = (state.voltage - step, state.voltage + step);
        let slewed = limits.hold(wanted.0, reachable, (self.slew, self.slew));
        let voltage = limits.hold(slewed, (self.lowest, self.highest), (Limits::LOWER, Limits::UPPER));
        state.voltage = voltage;
        let code = self.nearest(voltage);
        Drive { voltage: Volts(voltage), code: DacCode(code as u16), applied: self.voltage_of(code), limits }
    }

    /// Returns the voltage that the last tick put across the spring, rounded to a code.
    #[inline(always)]
    pub(crate) fn applied(&self, state: &State) -> Volts {
        self.volts(self.code(Volts(state.voltage)))
    }

    /// Returns `target` moved into the range, and [`Limits::TARGET`] if it had to be moved.
    #[inline(always)]
    pub(crate) fn clamp_target(&self, target: Volts) -> (Volts, Limits) {
        let mut limits = Limits::NONE;
        let held = limits.hold(target.0, (self.lowest, self.highest), (Limits::TARGET, Limits::TARGET));
        (Volts(held), limits)
    }

    /// Returns the lowest and the highest voltage that is put out, moved inward to the next code.
    pub fn range(&self) -> (Volts, Volts) {
        (Volts(self.lowest), Volts(self.highest))
    }

    /// Returns the code nearest to a voltage inside the range.
    #[inline(always)]
    pub fn code(&self, voltage: Volts) -> DacCode {
        DacCode(self.nearest(voltage.0) as u16)
    }

    /// Returns the voltage of a code, too low by at most 0.13 mV (at 16 bits; 9 uV at 12 bits).
    #[inline(always)]
    pub fn volts(&self, code: DacCode) -> Volts {
        self.voltage_of(u32::from(code.0))
    }

    /// Returns the number of the code nearest to a voltage inside the range, which fits 16 bits.
    #[inline(always)]
    fn nearest(&self, voltage: Signal) -> u32 {
        // 20 and 20 fraction bits; the upper half keeps 8 of them for rounding.
        let codes = (voltage.wide_mul(self.codes_per_volt).to_bits() >> 32) as i32;
        (codes + (1 << 7)) as u32 >> 8
    }

    /// Returns the voltage of the code of this number.
    #[inline(always)]
    fn voltage_of(&self, code: u32) -> Volts {
        Volts(Signal::from_bits(((i64::from(code) * i64::from(self.volts_per_code.to_bits())) >> 9) as i32))
    }
}

impl State {
    /// Returns the limited voltage of the last tick, before rounding to a code.
    pub fn voltage(&self) -> Volts {
        Volts(self.voltage)
    }
}

#[cfg(test)]
mod tests;
