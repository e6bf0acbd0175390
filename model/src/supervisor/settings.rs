//! The limits of the supervision, in SI units and quantized for the tick.

use crate::error::OutOfRange;
use crate::units::{Accumulator, SampleTime, Signal, accumulator, signal, steps};
use crate::validated::Validated;

/// Limits of the supervision, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Time without a valid frame of the host after which the target ramps down, 0.01 to 60 s.
    pub host_timeout_s: f64,
    /// Slope of that ramp, 10 to 100 000 V/s, downwards.
    pub ramp_v_per_s: f64,
    /// Number of missed ticks that are tolerated together, 1 to 100.
    pub missed_ticks_allowed: u32,
    /// Time after which one missed tick is forgotten, one sample time to 60 s.
    pub forget_missed_s: f64,
    /// Largest difference between the amplifier's voltage monitor and the output, 1 to 1000 V.
    pub monitor_tolerance_v: f64,
    /// Largest magnitude of the current monitor, 1e-6 to 1 A.
    pub max_current_a: f64,
    /// Lowest supply of the converters, 1 to 5 V.
    pub lowest_supply_v: f64,
    /// Highest supply of the converters, 1 to 5 V.
    pub highest_supply_v: f64,
    /// Time for which a monitor may disagree while the output is enabled, one sample time to 10 s; longer than the
    /// amplifier takes to settle.
    pub monitor_time_s: f64,
    /// Time for which a monitor may disagree while the output is disabled, one sample time to 60 s; longer than the
    /// spring takes to discharge.
    pub discharge_time_s: f64,
}

impl Settings {
    /// Host timeout 0.5 s, then a ramp of 700 V/s; five missed ticks, one forgotten per second; a monitor may disagree
    /// by more than 35 V (5 % of the source report's range) or 2 mA for 50 ms, and for 1 s while the output is
    /// disabled; the converters' supply may differ from 3.3 V by 5 %, which changes the output by as much.
    pub const DEFAULT: Self = Self {
        host_timeout_s: 0.5,
        ramp_v_per_s: 700.0,
        missed_ticks_allowed: 5,
        forget_missed_s: 1.0,
        monitor_tolerance_v: 35.0,
        max_current_a: 2e-3,
        lowest_supply_v: 3.135,
        highest_supply_v: 3.465,
        monitor_time_s: 0.05,
        discharge_time_s: 1.0,
    };

    /// Returns the host timeout in ticks, rounded as the supervisor rounds it.
    pub fn host_timeout_ticks(&self, sample_time: SampleTime) -> u32 {
        ticks(self.host_timeout_s, sample_time)
    }

    /// Checks every field and returns the token with which the limits can be quantized for `sample_time`.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first field outside its allowed range, its value and the range.
    pub fn validate(&self, sample_time: SampleTime) -> Result<Validated<'_, Self>, OutOfRange> {
        let Self { host_timeout_s, ramp_v_per_s, missed_ticks_allowed, forget_missed_s, .. } = *self;
        let Self { monitor_tolerance_v, max_current_a, monitor_time_s, discharge_time_s, .. } = *self;
        let Self { lowest_supply_v, highest_supply_v, .. } = *self;
        let seconds = sample_time.seconds();
        OutOfRange::check("host_timeout_s", host_timeout_s, 0.01..=60.0, "s")?;
        OutOfRange::check("ramp_v_per_s", ramp_v_per_s, 10.0..=1e5, "V/s")?;
        OutOfRange::check("missed_ticks_allowed", f64::from(missed_ticks_allowed), 1.0..=100.0, "ticks")?;
        OutOfRange::check("forget_missed_s", forget_missed_s, seconds..=60.0, "s")?;
        OutOfRange::check("monitor_tolerance_v", monitor_tolerance_v, 1.0..=1000.0, "V")?;
        OutOfRange::check("max_current_a", max_current_a, 1e-6..=1.0, "A")?;
        OutOfRange::check("lowest_supply_v", lowest_supply_v, 1.0..=5.0, "V")?;
        OutOfRange::check("highest_supply_v", highest_supply_v, lowest_supply_v..=5.0, "V")?;
        OutOfRange::check("monitor_time_s", monitor_time_s, seconds..=10.0, "s")?;
        OutOfRange::check("discharge_time_s", discharge_time_s, seconds..=60.0, "s")?;
        Ok(Validated::new(self, sample_time))
    }
}

impl Validated<'_, Settings> {
    /// Rounds the validated limits to the integers that a tick sees.
    pub fn quantize(self) -> Config {
        let (settings, sample_time) = (self.settings(), self.sample_time());
        let ticks = |time_s| ticks(time_s, sample_time);
        let forget = ticks(settings.forget_missed_s);
        Config {
            host_timeout: settings.host_timeout_ticks(sample_time),
            ramp_step: accumulator((settings.ramp_v_per_s * sample_time.seconds()).min(1000.0)),
            miss_cost: forget,
            miss_limit: forget.saturating_mul(settings.missed_ticks_allowed),
            tolerance: signal(settings.monitor_tolerance_v),
            max_current_ua: steps(settings.max_current_a, 1e6) as i32,
            supply_mv: (millivolts(settings.lowest_supply_v), millivolts(settings.highest_supply_v)),
            monitor_ticks: ticks(settings.monitor_time_s),
            discharge_ticks: ticks(settings.discharge_time_s),
        }
    }
}

/// Returns a voltage in mV, rounded to the nearest.
fn millivolts(volts: f64) -> u16 {
    steps(volts, 1000.0) as u16
}

/// Returns a time in ticks, rounded to the nearest.
fn ticks(time_s: f64, sample_time: SampleTime) -> u32 {
    steps(time_s, 1.0 / sample_time.seconds()) as u32
}

/// Validated limits, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    pub(super) host_timeout: u32,
    pub(super) ramp_step: Accumulator,
    /// What a missed tick adds to the counter: the number of ticks in which it is forgotten, as each tick takes off
    /// one.
    pub(super) miss_cost: u32,
    pub(super) miss_limit: u32,
    pub(super) tolerance: Signal,
    pub(super) max_current_ua: i32,
    /// Lowest and highest supply of the converters.
    pub(super) supply_mv: (u16, u16),
    pub(super) monitor_ticks: u32,
    pub(super) discharge_ticks: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_out_of_range_is_rejected_by_name() {
        let good = Settings::DEFAULT;
        for (field, wrong) in [
            ("host_timeout_s", Settings { host_timeout_s: 0.0, ..good }),
            ("host_timeout_s", Settings { host_timeout_s: f64::NAN, ..good }),
            ("ramp_v_per_s", Settings { ramp_v_per_s: -1.0, ..good }),
            ("missed_ticks_allowed", Settings { missed_ticks_allowed: 0, ..good }),
            ("forget_missed_s", Settings { forget_missed_s: 61.0, ..good }),
            ("monitor_tolerance_v", Settings { monitor_tolerance_v: 0.0, ..good }),
            ("max_current_a", Settings { max_current_a: 2.0, ..good }),
            ("lowest_supply_v", Settings { lowest_supply_v: 0.9, ..good }),
            ("highest_supply_v", Settings { highest_supply_v: 3.1, ..good }),
            ("monitor_time_s", Settings { monitor_time_s: 0.0, ..good }),
        ] {
            assert_eq!(wrong.validate(SampleTime::from_rate(1000.0).unwrap()).unwrap_err().field, field, "{wrong:?}");
        }
    }

    /// In floating point 0.29 * 100 is slightly less than 29.
    #[test]
    fn the_reported_host_timeout_is_the_one_that_is_counted() {
        let settings = Settings { host_timeout_s: 0.29, ..Settings::DEFAULT };
        let sample_time = SampleTime::from_rate(100.0).unwrap();
        assert_eq!(settings.host_timeout_ticks(sample_time), 29);
        assert_eq!(settings.validate(sample_time).unwrap().quantize().host_timeout, 29);
    }
}
