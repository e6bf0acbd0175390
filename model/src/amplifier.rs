//! The amplifier stage: what of a wanted voltage really comes out.
//!
//! In order: slew, range, rounding to a DAC code. The range wins over the slew, because it protects the spring. The
//! voltage before rounding is kept between ticks, and what a slew leaves below a signal's resolution is carried over, so
//! that the slowest slew still moves at its own rate.
//!
//! A code `n` of a `b`-bit converter stands for `n * full_scale / (2^b - 1)`. The ends of the range are moved inward to
//! the next code, so that rounding cannot leave it.

use fixed::types::I3F29;

use crate::error::OutOfRange;
use crate::units::{Accumulator, DacCode, SampleTime, Signal, Volts, accumulator, signal};

/// An amplifier and its converter, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplifier {
    /// Voltage at the highest code, 50 to 1000 V.
    pub full_scale_v: f64,
    /// Lowest voltage that may be put out, 0 V to one below `max_v`.
    pub min_v: f64,
    /// Highest voltage that may be put out, up to `full_scale_v`.
    pub max_v: f64,
    /// Fastest change in V/s, 1 to 1e9; `None` where a change within one tick is no concern.
    pub slew_v_per_s: Option<f64>,
    /// Width of the converter, 8 to 16 bits.
    pub dac_bits: u32,
}

impl Amplifier {
    /// The report's range: 0 to 700 V, from the 12-bit converter of the MCU.
    pub const PAPER: Self = Self::up_to(700.0);

    /// 0 V to `full_scale_v` from a 12-bit converter, no slew limit.
    pub const fn up_to(full_scale_v: f64) -> Self {
        Self { full_scale_v, min_v: 0.0, max_v: full_scale_v, slew_v_per_s: None, dac_bits: 12 }
    }

    /// The stricter of this one's highest voltage and slew, and those that were found on the real one.
    pub fn found_with(self, limit_v: Option<f64>, slew_v_per_s: Option<f64>) -> Self {
        // Not `f64::min`, which takes NaN for no limit at all: here it stays, and the check refuses it.
        let stricter = |own: f64, found: f64| if found > own { own } else { found };
        Self {
            max_v: limit_v.map_or(self.max_v, |limit| stricter(self.max_v, limit)),
            slew_v_per_s: [self.slew_v_per_s, slew_v_per_s].into_iter().flatten().reduce(stricter),
            ..self
        }
    }

    /// # Errors
    /// [`OutOfRange`] names the field.
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        let Self { full_scale_v, min_v, max_v, slew_v_per_s, dac_bits } = *self;
        OutOfRange::check("full_scale_v", full_scale_v, 50.0..=1000.0, "V")?;
        OutOfRange::check("dac_bits", f64::from(dac_bits), 8.0..=16.0, "bits")?;
        OutOfRange::check("min_v", min_v, 0.0..=full_scale_v - 10.0, "V")?;
        OutOfRange::check("max_v", max_v, min_v + 10.0..=full_scale_v, "V")?;
        OutOfRange::check("slew_v_per_s", slew_v_per_s.unwrap_or(1e9), 1.0..=1e9, "V/s")
    }

    /// The most by which the voltage changes in a tick, in V, where that is a limit.
    pub(crate) fn step_v(&self, sample_time: SampleTime) -> Option<f64> {
        self.slew_v_per_s.map(|slew| slew * sample_time.seconds()).filter(|step_v| *step_v < self.full_scale_v)
    }

    /// Volts between two neighbouring codes.
    pub fn volts_per_code(&self) -> f64 {
        self.full_scale_v / f64::from((1u32 << self.dac_bits) - 1)
    }
}

/// The amplifier for one sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    lowest: Signal,
    highest: Signal,
    /// What to report of a change that was held back: nothing where a tick is long enough for any change.
    slew: Limits,
    step: Accumulator,
    codes_per_volt: Signal,
    volts_per_code: I3F29,
}

/// The voltage at the amplifier's input, before rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    voltage: Signal,
    /// What the last step of the slew left below a signal's resolution, in 2^-52 V.
    carried: u32,
}

/// What comes out at one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    /// The limited voltage before rounding.
    pub voltage: Volts,
    /// What to write to the DAC.
    pub code: DacCode,
    /// The voltage that `code` puts across the spring.
    pub applied: Volts,
    /// What held the voltage back.
    pub limits: Limits,
}

/// Which limits acted in a tick; none is the normal case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits(u8);

impl Limits {
    /// Nothing was limited.
    pub const NONE: Self = Self(0);
    /// The range ended at `max_v`.
    pub const UPPER: Self = Self(1);
    /// The range ended at `min_v`.
    pub const LOWER: Self = Self(2);
    /// The change was held to `slew_v_per_s`.
    pub const SLEW: Self = Self(4);
    /// The target itself was outside of the range and taken at its end.
    pub const TARGET: Self = Self(8);

    /// True if any limit of `other` acted.
    pub const fn any_of(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// One byte for logs and telemetry: upper 1, lower 2, slew 4, target 8.
    pub const fn bits(self) -> u8 {
        self.0
    }

    #[inline(always)]
    pub(crate) fn with(self, other: Self, acted: bool) -> Self {
        if acted { Self(self.0 | other.0) } else { self }
    }
}

impl Config {
    /// Of an amplifier that [`Amplifier::check`] accepts.
    pub(crate) fn new(amplifier: &Amplifier, sample_time: SampleTime) -> Self {
        let step_v = amplifier.step_v(sample_time);
        let unit = amplifier.volts_per_code();
        let mut config = Self {
            lowest: Signal::ZERO,
            highest: Signal::ZERO,
            slew: Limits::NONE.with(Limits::SLEW, step_v.is_some()),
            step: accumulator(step_v.unwrap_or(amplifier.full_scale_v)),
            codes_per_volt: signal(1.0 / unit),
            // Rounded down: the highest code never stands for more than the full scale.
            volts_per_code: I3F29::from_bits((unit * f64::from(1 << 29)) as i32),
        };
        // Rounded up and down; a hair's breadth keeps an end that is a code's own voltage from losing that code.
        let hair = 1e-9;
        config.lowest = config.volts(DacCode((amplifier.min_v / unit + (1.0 - hair)) as u16)).0;
        config.highest = config.volts(DacCode((amplifier.max_v / unit + hair) as u16)).0;
        config
    }

    /// Puts out as much of `wanted` as the amplifier can.
    #[inline(always)]
    pub(crate) fn drive(&self, state: &mut State, wanted: Volts) -> Drive {
        let step = self.step.to_bits() + i64::from(state.carried);
        state.carried = step as u32;
        let step = Signal::from_bits((step >> 32) as i32);
        let slewed = wanted.0.max(state.voltage - step).min(state.voltage + step);
        let voltage = slewed.max(self.lowest).min(self.highest);
        state.voltage = voltage;
        let code = self.code(Volts(voltage));
        Drive {
            voltage: Volts(voltage),
            code,
            applied: self.volts(code),
            limits: Limits::NONE
                .with(self.slew, slewed != wanted.0)
                .with(Limits::UPPER, slewed > self.highest)
                .with(Limits::LOWER, slewed < self.lowest),
        }
    }

    /// The voltage that the last tick put across the spring, rounding included.
    #[inline(always)]
    pub(crate) fn applied(&self, state: &State) -> Volts {
        self.volts(self.code(Volts(state.voltage)))
    }

    /// `target` as far as the range goes, and whether it had to be moved.
    #[inline(always)]
    pub(crate) fn reachable(&self, target: Volts) -> (Volts, bool) {
        let reachable = target.0.max(self.lowest).min(self.highest);
        (Volts(reachable), reachable != target.0)
    }

    /// The range that is really used, its ends moved inward to the next code.
    pub fn range(&self) -> (Volts, Volts) {
        (Volts(self.lowest), Volts(self.highest))
    }

    /// The nearest code to a voltage inside the range.
    #[inline(always)]
    pub fn code(&self, voltage: Volts) -> DacCode {
        // 20 and 20 fraction bits; the upper half keeps 8 of them for rounding.
        let codes = (voltage.0.wide_mul(self.codes_per_volt).to_bits() >> 32) as i32;
        DacCode(((codes + (1 << 7)) >> 8) as u16)
    }

    /// The voltage of a code, low by at most 0.13 mV (at 16 bits; 9 uV at 12).
    #[inline(always)]
    pub fn volts(&self, code: DacCode) -> Volts {
        Volts(Signal::from_bits(((i64::from(code.0) * i64::from(self.volts_per_code.to_bits())) >> 9) as i32))
    }
}

impl State {
    /// The limited voltage of the last tick, before rounding.
    pub fn voltage(&self) -> Volts {
        Volts(self.voltage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn config(amplifier: &Amplifier, rate_hz: f64) -> Config {
        amplifier.check().unwrap();
        Config::new(amplifier, SampleTime::from_rate(rate_hz).unwrap())
    }

    fn volts(value: f64) -> Volts {
        Volts::new(value).unwrap()
    }

    proptest! {
        #[test]
        fn every_code_survives_the_way_to_volts_and_back(full_scale in 50.0..1000.0f64, bits in 8u32..=16, part: f64) {
            let config = config(&Amplifier { dac_bits: bits, ..Amplifier::up_to(full_scale) }, 1000.0);
            let code = DacCode((part.abs().fract() * f64::from((1u32 << bits) - 1)) as u16);
            prop_assert_eq!(config.code(config.volts(code)), code);
        }

        #[test]
        fn nothing_leaves_the_range_and_rounding_is_to_the_nearest_code(
            full_scale in 50.0..1000.0f64,
            (low, high) in (0.0..0.5f64, 0.6..1.0f64),
            bits in 8u32..=16,
            wanted in -2000.0..2000.0f64,
        ) {
            let (min_v, max_v) = (low * (full_scale - 30.0), high * full_scale);
            let amplifier = Amplifier { min_v, max_v, dac_bits: bits, ..Amplifier::up_to(full_scale) };
            let config = config(&amplifier, 1000.0);
            let (lowest, highest) = config.range();
            let unit = amplifier.volts_per_code();
            let inward = 0.0..unit + 3e-4;
            prop_assert!(inward.contains(&(lowest.to_f64() - min_v + 1.5e-4)));
            prop_assert!(inward.contains(&(max_v - highest.to_f64() + 1.5e-4)));

            let drive = config.drive(&mut State::default(), volts(wanted));
            let out = drive.applied;
            prop_assert!(out >= lowest && out <= highest, "{out:?} outside {lowest:?}..{highest:?}");
            let ideal = wanted.clamp(lowest.to_f64(), highest.to_f64());
            prop_assert!((out.to_f64() - ideal).abs() <= 0.503 * unit + 2e-6);
            prop_assert_eq!(drive.limits.any_of(Limits::UPPER), volts(wanted) > highest);
            prop_assert_eq!(drive.limits.any_of(Limits::LOWER), volts(wanted) < lowest);
            prop_assert!(!drive.limits.any_of(Limits::SLEW), "there is no limit of the slew");
        }

        #[test]
        fn a_slew_is_kept_on_average_even_below_one_code_a_tick(slew in 1.0..5000.0f64, rate in 100.0..10_000.0f64) {
            let config = config(&Amplifier { slew_v_per_s: Some(slew), ..Amplifier::PAPER }, rate);
            let mut state = State::default();
            let ticks = (rate / 20.0) as u32;
            let mut drive = config.drive(&mut state, volts(700.0));
            for _ in 1..ticks {
                drive = config.drive(&mut state, volts(700.0));
            }
            let expected = (slew / rate * f64::from(ticks)).min(700.0);
            prop_assert!((drive.voltage.to_f64() - expected).abs() < 5e-5);
            prop_assert_eq!(drive.limits.any_of(Limits::SLEW), expected < 700.0);
        }
    }

    #[test]
    fn a_wrong_amplifier_is_named() {
        let good = Amplifier::PAPER;
        for (field, wrong) in [
            ("full_scale_v", Amplifier { full_scale_v: 1500.0, ..good }),
            ("full_scale_v", Amplifier { full_scale_v: f64::NAN, ..good }),
            ("dac_bits", Amplifier { dac_bits: 24, ..good }),
            ("min_v", Amplifier { min_v: -5.0, ..good }),
            ("max_v", Amplifier { min_v: 500.0, max_v: 300.0, ..good }),
            ("max_v", Amplifier { max_v: 701.0, ..good }),
            ("slew_v_per_s", Amplifier { slew_v_per_s: Some(0.0), ..good }),
        ] {
            assert_eq!(wrong.check().unwrap_err().field, field, "{wrong:?}");
        }
    }
}
