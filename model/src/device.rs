//! Settings of a controller on an MCU that can be changed without compiling its program.
//!
//! Important terms:
//!
//! - *hang guard*: performs the emergency stop when the control task has not finished a tick in time.
//! - *task watchdog*: a fault when one of the other tasks has not checked in.
//! - *hardware watchdog*: resets the chip when it is not fed, which happens after each round of the task watchdog.
//!
//! The three of them have to act in this order, so that each is left to the next one only if it fails itself:
//! [`Settings::check`] demands that. Host and MCU call the same check, the one before it sends settings, the other before
//! it stores and before it runs them.

use crate::adaptation;
use crate::controller;
use crate::error::OutOfRange;
use crate::estimator::Plant;
use crate::isolation::{self, Causes, Tolerance};
use crate::supervisor;
use crate::units::SampleTime;
use crate::validated::Validate;

/// Lowest and highest rate of the tick on an MCU, in Hz.
const RATES_HZ: (u32, u32) = (100, 2000);
/// Clock of the tick's timer, in Hz: a period is a whole number of its cycles.
const TIMER_HZ: u32 = 1_000_000;
/// Longest round of the task watchdog, in ms: tasks check in every 10 ms, or after waiting for the line for up to 20 ms, for the adaptation
/// for up to 30 ms, or for a page of flash to be erased, 25 ms, which delays the others too.
pub const LONGEST_ROUND_MS: u32 = 45;
/// Largest tolerance of the voltage monitor, as a part of the amplifier's full scale.
const MOST_TOLERANCE: f64 = 0.1;
/// Largest tolerated current, in A, below the end of the monitor's range of 5 mA: beyond, none would be seen.
const MOST_CURRENT_A: f64 = 4e-3;
/// Longest time without feeding after which a chip may be reset, in ms.
const LONGEST_RESET_MS: u32 = 2000;

/// Loop, supervision and watchdogs of a controller on an MCU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Rate, spring, pre-compensator, amplifier and sensor. The rate is a whole number of Hz, 100 to 2000, whose period is
    /// a whole number of microseconds.
    pub control: controller::Settings,
    /// Limits of the supervision.
    pub supervision: supervisor::Settings,
    /// Times of the watchdogs.
    pub watchdogs: Watchdogs,
    /// Causes that are a fault once the isolation bank has named them, so that the output is disabled; none by default. A set that is
    /// not empty needs a sensor.
    pub trip_on_cause: Causes,
    /// Errors of the model that are no fault for the isolation bank; none by default.
    pub tolerance: Tolerance,
    /// Adaptation of the running model to what the isolation bank names; `None` if nothing adapts. It needs a sensor.
    pub adaptation: Option<adaptation::Settings>,
}

/// Times after which the three watchdogs act, in ms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watchdogs {
    /// Time without a tick after which the hang guard performs the emergency stop, in ms: more than two ticks beyond the missed
    /// ones that the supervisor tolerates, so that a late control task still reports its overrun itself, to 1000 ms.
    pub hang_ms: u32,
    /// Time without a complete round of the task watchdog after which the output is disabled, in ms: the longest round of 45 ms and
    /// two ticks, to 1000 ms.
    pub stall_ms: u32,
    /// Time without feeding after which the hardware watchdog resets the chip, in ms: 10 % more than the others need, since its
    /// clock is a few percent off, to 2000 ms.
    pub reset_ms: u32,
}

impl Watchdogs {
    /// 12 ms, 50 ms and 100 ms.
    pub const DEFAULT: Self = Self { hang_ms: 12, stall_ms: 50, reset_ms: 100 };
}

impl Settings {
    /// The source report's loop with the default supervision and watchdogs.
    pub const PAPER: Self = Self {
        control: controller::Settings::PAPER,
        supervision: supervisor::Settings::DEFAULT,
        watchdogs: Watchdogs::DEFAULT,
        trip_on_cause: Causes::NONE,
        tolerance: Tolerance::NONE,
        adaptation: None,
    };

    /// Returns the settings of the isolation bank for the spring `plant` behind an amplifier with this highest voltage, in V: noise and
    /// interval are those of the sensor. `None` without one.
    pub fn isolation(&self, plant: Plant, highest_v: f64) -> Option<isolation::Settings> {
        let [noise_v, _, _, interval_s, ..] = self.control.feedback.as_ref()?.values();
        let tolerance = self.tolerance;
        Some(isolation::Settings {
            plant,
            noise_v,
            interval_s,
            range_v: highest_v,
            tolerance,
            ..isolation::Settings::PAPER
        })
    }

    /// Returns the rate of the tick, in whole Hz.
    pub fn rate_hz(&self) -> u32 {
        self.control.rate_hz as u32
    }

    /// Checks every field, and the fields against each other, but for [`Settings::check_adaptation`].
    ///
    /// # Errors
    /// [`OutOfRange`] names the first field outside its allowed range, its value and the range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let Self { control, supervision, watchdogs: Watchdogs { hang_ms, stall_ms, reset_ms }, trip_on_cause, .. } =
            self;
        check_rate(control.rate_hz)?;
        control.validate()?;
        let sample_time = SampleTime::from_rate(control.rate_hz)?;
        supervision.validate(sample_time)?;
        self.tolerance.check()?;
        if !trip_on_cause.is_empty() {
            match self.isolation(control.plant, control.amplifier.max_v) {
                Some(bank) => bank.validate(sample_time).map(drop)?,
                None => trip_on_cause.check_none("causes without a sensor")?,
            }
        }
        // A monitor with a wider tolerance could agree with anything.
        let most_v = MOST_TOLERANCE * control.amplifier.full_scale_v;
        OutOfRange::check("monitor_tolerance_v", supervision.monitor_tolerance_v, 1.0..=most_v, "V")?;
        OutOfRange::check("max_current_a", supervision.max_current_a, 1e-6..=MOST_CURRENT_A, "A")?;
        let ticks_ms = |ticks: u32| (1000 * ticks).div_ceil(self.rate_hz());
        // The guard counts whole ms, the first of which may be short.
        let hang_ms_from = ticks_ms(supervision.missed_ticks_allowed + 2) + 1;
        let stall_ms_from = LONGEST_ROUND_MS + ticks_ms(2);
        let longest = LONGEST_RESET_MS / 2;
        for (field, value, lowest, highest) in
            [("hang_ms", *hang_ms, hang_ms_from, longest), ("stall_ms", *stall_ms, stall_ms_from, longest)]
        {
            OutOfRange::check(field, f64::from(value), f64::from(lowest)..=f64::from(highest), "ms")?;
        }
        // The last feeding may be a whole round before a hang.
        let others_ms = (*stall_ms).max(hang_ms + LONGEST_ROUND_MS) + ticks_ms(2);
        let reset_ms_from = others_ms + others_ms.div_ceil(10);
        let allowed = f64::from(reset_ms_from)..=f64::from(LONGEST_RESET_MS);
        OutOfRange::check("reset_ms", f64::from(*reset_ms), allowed, "ms")
    }

    /// Checks the adaptation, with the springs at all ends of its bounds. A function of its own: an image without an adaptation has none
    /// to check.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first field outside its allowed range, its value and the range.
    #[inline(never)]
    pub fn check_adaptation(&self) -> Result<(), OutOfRange> {
        let Self { control, adaptation: Some(adaptation), .. } = self else { return Ok(()) };
        let bank = self.isolation(control.plant, control.amplifier.max_v);
        OutOfRange::check_count("adaptation.enabled", 1, 0..=usize::from(bank.is_some()), "without a sensor")?;
        adaptation.validate(SampleTime::from_rate(control.rate_hz)?)?;
        bank.map_or(Ok(()), |bank| adaptation.check_for(control, &bank))
    }
}

/// Checks a rate, in Hz. One without a whole number of microseconds in its period is rejected with the next lower rate
/// that has, as the only allowed value.
fn check_rate(rate_hz: f64) -> Result<(), OutOfRange> {
    let (lowest, highest) = RATES_HZ;
    OutOfRange::check("rate_hz", rate_hz, f64::from(lowest)..=f64::from(highest), "Hz")?;
    let whole = |rate: &u32| TIMER_HZ.is_multiple_of(*rate);
    let next = (lowest..=rate_hz as u32).rev().find(whole).unwrap_or(lowest);
    OutOfRange::check("rate_hz", rate_hz, f64::from(next)..=f64::from(next), "Hz")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    const GOOD: Settings = Settings::PAPER;

    fn at(rate_hz: f64, watchdogs: Watchdogs) -> Settings {
        Settings { control: controller::Settings { rate_hz, ..GOOD.control }, watchdogs, ..GOOD }
    }

    #[test]
    fn a_rate_is_allowed_if_its_period_is_a_whole_number_of_microseconds() {
        let slow = Watchdogs { hang_ms: 90, stall_ms: 80, reset_ms: 200 };
        for rate_hz in [100.0, 125.0, 500.0, 1000.0, 1250.0, 2000.0] {
            assert_eq!(at(rate_hz, slow).check(), Ok(()), "{rate_hz}");
        }
        for (rate_hz, expected) in [
            (99.0, "100 to 2000 Hz"),
            (2001.0, "100 to 2000 Hz"),
            (f64::NAN, "100 to 2000 Hz"),
            (300.0, "250 Hz"),
            (1000.5, "1000 Hz"),
            (1999.0, "1600 Hz"),
        ] {
            let error = at(rate_hz, slow).check().unwrap_err();
            assert_eq!(error.field, "rate_hz");
            assert!(error.to_string().ends_with(&std::format!("expected {expected}")), "{error}");
        }
    }

    #[test]
    fn the_watchdogs_act_in_their_order_and_after_the_tolerated_overrun() {
        let watchdogs = |hang_ms, stall_ms, reset_ms| Watchdogs { hang_ms, stall_ms, reset_ms };
        for (rate_hz, watchdogs, expected) in [
            (1000.0, GOOD.watchdogs, Ok(())),
            (1000.0, watchdogs(8, 47, 61), Ok(())),
            (1000.0, watchdogs(7, 50, 100), Err(("hang_ms", 8.0, 1000.0))),
            (1000.0, watchdogs(1001, 50, 2000), Err(("hang_ms", 8.0, 1000.0))),
            (1000.0, watchdogs(12, 46, 100), Err(("stall_ms", 47.0, 1000.0))),
            (1000.0, watchdogs(12, 1001, 2000), Err(("stall_ms", 47.0, 1000.0))),
            (1000.0, watchdogs(12, 100, 100), Err(("reset_ms", 113.0, 2000.0))),
            (1000.0, watchdogs(100, 50, 100), Err(("reset_ms", 162.0, 2000.0))),
            (1000.0, watchdogs(12, 50, 0), Err(("reset_ms", 65.0, 2000.0))),
            (1000.0, watchdogs(12, 50, 2001), Err(("reset_ms", 65.0, 2000.0))),
            (100.0, GOOD.watchdogs, Err(("hang_ms", 71.0, 1000.0))),
            (100.0, watchdogs(71, 50, 200), Err(("stall_ms", 65.0, 1000.0))),
            (100.0, watchdogs(71, 65, 150), Ok(())),
            (2000.0, watchdogs(5, 50, 100), Ok(())),
            (2000.0, watchdogs(4, 50, 100), Err(("hang_ms", 5.0, 1000.0))),
        ] {
            let found = at(rate_hz, watchdogs).check().map_err(|error| (error.field, error.lowest, error.highest));
            assert_eq!(found, expected, "{rate_hz} Hz, {watchdogs:?}");
        }
    }

    #[test]
    fn loop_and_supervision_are_checked_too() {
        let amplifier = crate::Amplifier::up_to(1500.0);
        let control = controller::Settings { amplifier, ..GOOD.control };
        assert_eq!(Settings { control, ..GOOD }.check().unwrap_err().field, "full_scale_v");
        let supervision = supervisor::Settings { ramp_v_per_s: 0.0, ..GOOD.supervision };
        assert_eq!(Settings { supervision, ..GOOD }.check().unwrap_err().field, "ramp_v_per_s");
    }

    #[test]
    fn a_trip_needs_a_sensor_that_the_isolation_bank_can_use() {
        let trip_on_cause = Causes::NONE.with(isolation::Cause::StuckSensor);
        let with = |values: [f64; 8], trip_on_cause| {
            let control = controller::Settings { feedback: crate::Feedback::from_values(values), ..GOOD.control };
            Settings { control, trip_on_cause, ..GOOD }.check()
        };
        assert_eq!(Settings { trip_on_cause, ..GOOD }.check().unwrap_err().field, "trip_on_cause");
        if let Some(feedback) = crate::Feedback::from_values([1.0, 1.0, 0.1, 1e-3, 0.01, -50.0, 1000.0, 2.0]) {
            let usual = feedback.values();
            assert_eq!(with(usual, trip_on_cause), Ok(()));
            // Readings every 80 ms correct the estimate, and are too few for a block of 128 ms.
            let mut rare = usual;
            rare[3] = 0.08;
            assert_eq!(with(rare, Causes::NONE), Ok(()));
            assert_eq!(with(rare, trip_on_cause).unwrap_err().field, "interval_s");
        }
    }

    #[test]
    fn the_isolation_bank_watches_the_spring_with_the_sensor_and_the_tolerance_of_the_device() {
        let plant = Plant { share: 0.2, time_constant_s: 3.0 };
        let tolerance = Tolerance::from_values([0.1, 0.2, 0.05]);
        assert_eq!(Settings { tolerance, ..GOOD }.isolation(plant, 500.0), None);
        if let Some(feedback) = crate::Feedback::from_values([2.0, 1.0, 0.1, 5e-3, 0.01, -50.0, 1000.0, 2.0]) {
            let control = controller::Settings { feedback: Some(feedback), ..GOOD.control };
            let bank = Settings { control, tolerance, ..GOOD }.isolation(plant, 500.0);
            let usual = isolation::Settings::PAPER;
            let expected =
                isolation::Settings { plant, noise_v: 2.0, interval_s: 5e-3, range_v: 500.0, tolerance, ..usual };
            assert_eq!(bank, Some(expected));
        }
    }

    #[test]
    fn an_adaptation_needs_a_sensor_and_bounds_within_which_the_spring_can_be_run() {
        let with = |adaptation, feedback| {
            let control = controller::Settings { feedback, ..GOOD.control };
            Settings { control, adaptation: Some(adaptation), ..GOOD }.check_adaptation().map_err(|error| error.field)
        };
        let typical = adaptation::Settings::TYPICAL;
        assert_eq!(with(typical, None), Err("adaptation.enabled"));
        if let Some(feedback) = crate::Feedback::from_values([1.0, 1.0, 0.1, 1e-3, 0.01, -50.0, 1000.0, 2.0]) {
            assert_eq!(with(typical, Some(feedback)), Ok(()));
            for (index, value, field) in [
                (0, 0.6, "adaptation.time_constant"),
                (1, f64::NAN, "adaptation.share"),
                (2, -0.1, "adaptation.gain"),
                (3, 0.0, "adaptation.rate_per_s"),
                (4, 0.2, "adaptation.precision"),
                (5, 2.0, "adaptation.excitation"),
            ] {
                let mut values = typical.values();
                values[index] = value;
                assert_eq!(with(adaptation::Settings::from_values(values), Some(feedback)), Err(field));
            }
        }
    }

    #[test]
    fn a_tolerance_is_at_most_a_quarter() {
        for (values, field) in [
            ([0.3, 0.0, 0.0], "tolerance.time_constant"),
            ([0.0, -0.1, 0.0], "tolerance.share"),
            ([0.0, 0.0, f64::NAN], "tolerance.gain"),
        ] {
            let tolerance = Tolerance::from_values(values);
            assert_eq!(Settings { tolerance, ..GOOD }.check().unwrap_err().field, field);
        }
        assert_eq!(Settings { tolerance: Tolerance::from_values([0.25; 3]), ..GOOD }.check(), Ok(()));
    }

    #[test]
    fn monitors_that_would_agree_with_anything_are_rejected() {
        let with = |monitor_tolerance_v, max_current_a| Settings {
            supervision: supervisor::Settings { monitor_tolerance_v, max_current_a, ..GOOD.supervision },
            ..GOOD
        };
        assert_eq!(with(70.0, 4e-3).check(), Ok(()));
        assert_eq!(with(70.1, 2e-3).check().unwrap_err().field, "monitor_tolerance_v");
        assert_eq!(with(35.0, 5e-3).check().unwrap_err().field, "max_current_a");
        // A lower full scale asks for a narrower tolerance than the default.
        let control = controller::Settings { amplifier: crate::Amplifier::up_to(300.0), ..GOOD.control };
        assert_eq!(Settings { control, ..GOOD }.check().unwrap_err().field, "monitor_tolerance_v");
    }
}
