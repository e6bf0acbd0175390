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

use crate::controller;
use crate::error::OutOfRange;
use crate::supervisor;
use crate::units::SampleTime;

/// Lowest and highest rate of the tick on an MCU, in Hz.
const RATES_HZ: (u32, u32) = (100, 2000);
/// Clock of the tick's timer, in Hz: a period is a whole number of its cycles.
const TIMER_HZ: u32 = 1_000_000;
/// Shortest time in which the task watchdog can complete a round, in ms: tasks check in every 10 ms, or after waiting for
/// the line for up to 20 ms.
const SHORTEST_STALL_MS: u32 = 30;
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
}

/// Times after which the three watchdogs act, in ms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watchdogs {
    /// Time without a tick after which the hang guard performs the emergency stop, in ms: two ticks more than the missed
    /// ones that the supervisor tolerates, so that a late control task still reports its overrun itself, to less than
    /// `reset_ms`.
    pub hang_ms: u32,
    /// Time without a complete round of the task watchdog after which the output is disabled, 30 ms to less than
    /// `reset_ms`.
    pub stall_ms: u32,
    /// Time without feeding after which the hardware watchdog resets the chip, in ms, up to 2000.
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
    };

    /// Returns the rate of the tick, in whole Hz.
    pub fn rate_hz(&self) -> u32 {
        self.control.rate_hz as u32
    }

    /// Checks every field, and the fields against each other.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first field outside its allowed range, its value and the range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let Self { control, supervision, watchdogs: Watchdogs { hang_ms, stall_ms, reset_ms } } = self;
        check_rate(control.rate_hz)?;
        control.validate()?;
        supervision.validate(SampleTime::from_rate(control.rate_hz)?)?;
        let tolerated = supervision.missed_ticks_allowed + 2;
        let hang_ms_from = (1000 * tolerated).div_ceil(self.rate_hz());
        let reset_ms_from = SHORTEST_STALL_MS.max(hang_ms_from) + 1;
        let before_reset = reset_ms.saturating_sub(1);
        for (field, value, lowest, highest) in [
            ("reset_ms", *reset_ms, reset_ms_from, LONGEST_RESET_MS),
            ("hang_ms", *hang_ms, hang_ms_from, before_reset),
            ("stall_ms", *stall_ms, SHORTEST_STALL_MS, before_reset),
        ] {
            OutOfRange::check(field, f64::from(value), f64::from(lowest)..=f64::from(highest), "ms")?;
        }
        Ok(())
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
        let slow = Watchdogs { hang_ms: 90, ..GOOD.watchdogs };
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
            (1000.0, watchdogs(7, 30, 31), Ok(())),
            (1000.0, watchdogs(6, 50, 100), Err(("hang_ms", 7.0, 99.0))),
            (1000.0, watchdogs(100, 50, 100), Err(("hang_ms", 7.0, 99.0))),
            (1000.0, watchdogs(12, 29, 100), Err(("stall_ms", 30.0, 99.0))),
            (1000.0, watchdogs(12, 100, 100), Err(("stall_ms", 30.0, 99.0))),
            (1000.0, watchdogs(12, 50, 30), Err(("reset_ms", 31.0, 2000.0))),
            (1000.0, watchdogs(12, 50, 0), Err(("reset_ms", 31.0, 2000.0))),
            (1000.0, watchdogs(12, 50, 2001), Err(("reset_ms", 31.0, 2000.0))),
            (100.0, GOOD.watchdogs, Err(("hang_ms", 70.0, 99.0))),
            (100.0, watchdogs(70, 50, 71), Ok(())),
            (100.0, watchdogs(70, 50, 70), Err(("reset_ms", 71.0, 2000.0))),
            (2000.0, watchdogs(4, 50, 100), Ok(())),
            (2000.0, watchdogs(3, 50, 100), Err(("hang_ms", 4.0, 99.0))),
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
}
