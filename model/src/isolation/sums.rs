//! What is added up in each tick of a block, and the means at its end.

use super::Config;
use super::bank::{SLEW_TICKS, SMOOTH_V};
use crate::coefficient::WideGain;
use crate::units::{ScaledStiffness, Signal, Volts, saturated_to_32};

/// Changes of the voltage that are no jump, with 20 fraction bits.
const SMOOTH: u32 = (SMOOTH_V * 1_048_576.0) as u32;

/// Sums over the ticks of the present block, divided by their number: in V with 20 fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sums {
    /// Number of ticks in the sums.
    pub(super) ticks: u32,
    voltage: i32,
    model: i32,
    jumps: i64,
    residual: i64,
    /// Number of ticks without a reading.
    missing: u32,
    identical: u32,
    lags: [i32; 3],
    /// Sums of the model at the beginning of the last quarter and of the last half of the block.
    marks: [i32; 2],
    slewed: [i32; 3],
    last_voltage: i32,
    last_model: i32,
    last_reading: i32,
}

/// Means over a block, in V with 20 fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Means {
    pub(super) voltage: i32,
    pub(super) model: i32,
    /// Sum of `du |du|`, in V^2 with 10 fraction bits.
    pub(super) jumps: i32,
    /// Mean distance of the slewed voltages from the voltage.
    pub(super) lags: [i32; 3],
    /// Sums of the model over the last quarter and the last half of the block, divided by the ticks of the block.
    pub(super) tails: [i32; 2],
    /// The model in the last tick.
    pub(super) end: i32,
    pub(super) residual: i32,
    /// True if there were enough readings.
    pub(super) usable: bool,
    pub(super) last_reading: i32,
    /// True if three quarters of the readings equal the one before.
    pub(super) pinned: bool,
}

impl Means {
    /// Before the first block.
    pub(super) const NEW: Self = Self {
        voltage: 0,
        model: 0,
        jumps: 0,
        lags: [0; 3],
        tails: [0; 2],
        end: 0,
        residual: 0,
        usable: false,
        last_reading: 0,
        pinned: false,
    };
}

impl Sums {
    /// Before the first tick.
    pub(super) const NEW: Self = Self {
        ticks: 0,
        voltage: 0,
        model: 0,
        jumps: 0,
        residual: 0,
        missing: 0,
        identical: 0,
        lags: [0; 3],
        marks: [0; 2],
        slewed: [0; 3],
        last_voltage: 0,
        last_model: 0,
        last_reading: 0,
    };

    /// Adds one tick.
    #[inline(always)]
    pub(super) fn add(&mut self, config: &Config, voltage: Volts, model: ScaledStiffness, reading: Option<Signal>) {
        let (voltage, model) = (voltage.0.to_bits(), model.0.to_bits());
        let change = voltage.saturating_sub(self.last_voltage);
        self.last_voltage = voltage;
        self.last_model = model;
        self.voltage += voltage >> config.shift;
        if self.ticks & config.quarter_mask == 0 {
            // The beginning of a quarter; at the end of the block those of the last two are left.
            self.marks = [self.model, self.marks[0]];
        }
        self.model += model >> config.shift;
        if change.unsigned_abs() > SMOOTH {
            let change = i64::from(change);
            self.jumps += (change * change.abs()) >> 20;
        }
        // One of the slewed voltages takes its step.
        let index = (self.ticks % SLEW_TICKS) as usize;
        if index < 3 {
            let (slewed, reach) = (&mut self.slewed[index], config.reach[index]);
            *slewed = voltage.max(slewed.saturating_sub(reach)).min(slewed.saturating_add(reach));
            self.lags[index] += slewed.saturating_sub(voltage) >> config.slew_shift;
        }
        if let Some(reading) = reading {
            let reading = reading.to_bits();
            self.residual += i64::from(reading.saturating_sub(model));
            self.identical += u32::from(reading == self.last_reading);
            self.last_reading = reading;
        } else {
            self.missing += 1;
        }
        self.ticks += 1;
    }

    /// Returns the means and starts the next block.
    #[inline(never)]
    pub(super) fn finish(&mut self, config: &Config) -> Means {
        let readings = self.ticks.saturating_sub(self.missing);
        let means = Means {
            voltage: self.voltage,
            model: self.model,
            jumps: saturated_to_32(self.jumps >> 10),
            lags: self.lags,
            tails: self.marks.map(|mark| self.model - mark),
            end: self.last_model,
            residual: self.residual.checked_div(i64::from(readings)).unwrap_or(0) as i32,
            usable: readings >= config.fewest,
            last_reading: self.last_reading,
            pinned: readings >= 4 && 4 * self.identical >= 3 * readings,
        };
        let Self { slewed, last_voltage, last_model, last_reading, .. } = *self;
        *self = Self { slewed, last_voltage, last_model, last_reading, ..Self::NEW };
        means
    }
}

/// Returns `bits * gain`, saturated to 32 bits.
#[inline(always)]
pub(super) fn times(gain: WideGain, bits: i32) -> i32 {
    gain.times(Signal::from_bits(bits)).to_bits()
}
