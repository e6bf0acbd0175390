//! What is added up in each tick of a block, and the means at its end.

use super::Config;
use crate::coefficient::WideGain;
use crate::units::{ScaledStiffness, Signal, Volts, saturated_to_32};

/// Sums over the ticks of the present block; numbers in V have 20 fraction bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Sums {
    /// Number of ticks in the sums.
    pub(super) ticks: u32,
    voltage: i64,
    model: i64,
    jumps: i64,
    residual: i64,
    readings: u32,
    identical: u32,
    lags: [i64; 3],
    tails: [i64; 2],
    slewed: [i32; 3],
    last_voltage: i32,
    last_model: i32,
    last_reading: i32,
}

/// Means over a block, in V with 20 fraction bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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

impl Sums {
    /// Adds one tick.
    #[inline(always)]
    pub(super) fn add(&mut self, config: &Config, voltage: Volts, model: ScaledStiffness, reading: Option<Signal>) {
        let (voltage, model) = (voltage.0.to_bits(), model.0.to_bits());
        let change = i64::from(voltage.saturating_sub(self.last_voltage));
        self.last_voltage = voltage;
        self.last_model = model;
        self.voltage += i64::from(voltage);
        self.model += i64::from(model);
        if change != 0 {
            self.jumps += (change * change.abs()) >> 20;
        }
        let left = config.ticks - self.ticks;
        if left <= config.ticks >> 1 {
            self.tails[1] += i64::from(model);
            if left <= config.ticks >> 2 {
                self.tails[0] += i64::from(model);
            }
        }
        for ((slewed, lag), reach) in self.slewed.iter_mut().zip(&mut self.lags).zip(config.reach) {
            *slewed = voltage.max(slewed.saturating_sub(reach)).min(slewed.saturating_add(reach));
            *lag += i64::from(slewed.saturating_sub(voltage));
        }
        if let Some(reading) = reading {
            let reading = reading.to_bits();
            self.residual += i64::from(reading.saturating_sub(model));
            self.readings += 1;
            self.identical += u32::from(reading == self.last_reading);
            self.last_reading = reading;
        }
        self.ticks += 1;
    }

    /// Returns the means and starts the next block.
    #[inline(never)]
    pub(super) fn finish(&mut self, config: &Config) -> Means {
        let mean = |sum: i64| (sum >> config.shift) as i32;
        let means = Means {
            voltage: mean(self.voltage),
            model: mean(self.model),
            jumps: saturated_to_32(self.jumps >> 10),
            lags: self.lags.map(mean),
            tails: self.tails.map(mean),
            end: self.last_model,
            residual: self.residual.checked_div(i64::from(self.readings)).unwrap_or(0) as i32,
            usable: self.readings >= config.fewest,
            last_reading: self.last_reading,
            pinned: self.readings >= 4 && 4 * self.identical >= 3 * self.readings,
        };
        let Self { slewed, last_voltage, last_model, last_reading, .. } = *self;
        *self = Self { slewed, last_voltage, last_model, last_reading, ..Self::default() };
        means
    }
}

/// Returns `bits * gain`, saturated to 32 bits.
#[inline(always)]
pub(super) fn times(gain: WideGain, bits: i32) -> i32 {
    gain.times(Signal::from_bits(bits)).to_bits()
}
