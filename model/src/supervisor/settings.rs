//! The limits of the supervision, in SI units and scaled for the tick.

use crate::error::OutOfRange;
use crate::units::{Accumulator, SampleTime, Signal, accumulator, signal, steps};

/// Limits of the supervision, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Silence of the host, in s, after which the target is ramped down, 0.01 to 60.
    pub host_timeout_s: f64,
    /// How fast the target then falls, in V/s, 10 to 100 000.
    pub ramp_v_per_s: f64,
    /// Missed ticks that are forgiven at once, 1 to 100.
    pub missed_ticks_allowed: u32,
    /// Time in s after which one of them is forgotten, one sample time to 60.
    pub forget_missed_s: f64,
    /// Largest difference in V between the amplifier's voltage monitor and what was put out, 1 to 1000.
    pub monitor_tolerance_v: f64,
    /// Largest reading of the current monitor, in A, either direction, 1e-6 to 1.
    pub max_current_a: f64,
    /// How long, in s, a monitor may disagree, one sample time to 10; longer than the amplifier takes to settle.
    pub monitor_time_s: f64,
    /// The same while nothing may leave, in s, one sample time to 60; longer than a voltage that was taken away takes to go.
    pub discharge_time_s: f64,
}

impl Settings {
    /// Half a second without a host, then 700 V/s down; five missed ticks, one forgotten a second; 35 V, 5 % of the
    /// report's range, and 2 mA for 50 ms, or for a second while nothing may leave.
    pub const DEFAULT: Self = Self {
        host_timeout_s: 0.5,
        ramp_v_per_s: 700.0,
        missed_ticks_allowed: 5,
        forget_missed_s: 1.0,
        monitor_tolerance_v: 35.0,
        max_current_a: 2e-3,
        monitor_time_s: 0.05,
        discharge_time_s: 1.0,
    };

    /// Silence of the host in ticks, as the supervisor counts it.
    pub fn host_timeout_ticks(&self, sample_time: SampleTime) -> u32 {
        ticks(self.host_timeout_s, sample_time)
    }

    /// Scales the settings for the tick.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field.
    pub fn check(&self, sample_time: SampleTime) -> Result<Config, OutOfRange> {
        let Self { host_timeout_s, ramp_v_per_s, missed_ticks_allowed, forget_missed_s, .. } = *self;
        let Self { monitor_tolerance_v, max_current_a, monitor_time_s, discharge_time_s, .. } = *self;
        let seconds = sample_time.seconds();
        OutOfRange::check("host_timeout_s", host_timeout_s, 0.01..=60.0, "s")?;
        OutOfRange::check("ramp_v_per_s", ramp_v_per_s, 10.0..=1e5, "V/s")?;
        OutOfRange::check("missed_ticks_allowed", f64::from(missed_ticks_allowed), 1.0..=100.0, "ticks")?;
        OutOfRange::check("forget_missed_s", forget_missed_s, seconds..=60.0, "s")?;
        OutOfRange::check("monitor_tolerance_v", monitor_tolerance_v, 1.0..=1000.0, "V")?;
        OutOfRange::check("max_current_a", max_current_a, 1e-6..=1.0, "A")?;
        OutOfRange::check("monitor_time_s", monitor_time_s, seconds..=10.0, "s")?;
        OutOfRange::check("discharge_time_s", discharge_time_s, seconds..=60.0, "s")?;
        let ticks = |time_s| ticks(time_s, sample_time);
        let forget = ticks(forget_missed_s);
        Ok(Config {
            host_timeout: self.host_timeout_ticks(sample_time),
            ramp_step: accumulator((ramp_v_per_s * seconds).min(1000.0)),
            miss_cost: forget,
            miss_limit: forget.saturating_mul(missed_ticks_allowed),
            tolerance: signal(monitor_tolerance_v),
            max_current_ua: steps(max_current_a, 1e6) as i32,
            monitor_ticks: ticks(monitor_time_s),
            discharge_ticks: ticks(discharge_time_s),
        })
    }
}

/// Rounded.
fn ticks(time_s: f64, sample_time: SampleTime) -> u32 {
    steps(time_s, 1.0 / sample_time.seconds()) as u32
}

/// Checked limits, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    pub(super) host_timeout: u32,
    pub(super) ramp_step: Accumulator,
    /// A missed tick costs as many as it takes to forget it; each tick gives one back.
    pub(super) miss_cost: u32,
    pub(super) miss_limit: u32,
    pub(super) tolerance: Signal,
    pub(super) max_current_ua: i32,
    pub(super) monitor_ticks: u32,
    pub(super) discharge_ticks: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_settings_are_named() {
        let good = Settings::DEFAULT;
        for (field, wrong) in [
            ("host_timeout_s", Settings { host_timeout_s: 0.0, ..good }),
            ("host_timeout_s", Settings { host_timeout_s: f64::NAN, ..good }),
            ("ramp_v_per_s", Settings { ramp_v_per_s: -1.0, ..good }),
            ("missed_ticks_allowed", Settings { missed_ticks_allowed: 0, ..good }),
            ("forget_missed_s", Settings { forget_missed_s: 61.0, ..good }),
            ("monitor_tolerance_v", Settings { monitor_tolerance_v: 0.0, ..good }),
            ("max_current_a", Settings { max_current_a: 2.0, ..good }),
            ("monitor_time_s", Settings { monitor_time_s: 0.0, ..good }),
        ] {
            assert_eq!(wrong.check(SampleTime::from_rate(1000.0).unwrap()).unwrap_err().field, field, "{wrong:?}");
        }
    }

    /// 0.29 times 100 is a little less than 29 in floating point.
    #[test]
    fn the_host_is_told_the_silence_that_is_counted() {
        let settings = Settings { host_timeout_s: 0.29, ..Settings::DEFAULT };
        let sample_time = SampleTime::from_rate(100.0).unwrap();
        assert_eq!(settings.host_timeout_ticks(sample_time), 29);
        assert_eq!(settings.check(sample_time).unwrap().host_timeout, 29);
    }
}
