//! Settings that are built into an image: spring, controller, amplifier, supervision and timing. A block of settings in flash
//! replaces those of [`link::WireSettings`], see [`crate::start`]; the others need another image.

#[cfg(feature = "fast")]
use model::Approach;
#[cfg(any(feature = "fast", feature = "robust"))]
use model::Compensation;
#[cfg(feature = "robust")]
use model::Margin;
use model::device::{self, Watchdogs};
use model::isolation::{Causes, Tolerance};
use model::{Amplifier, Feedback, Settings, adaptation, supervisor};

/// Rate of the control tick that is built in, in Hz: 100 to 2000, with a period in whole microseconds.
pub const RATE_HZ: u32 = 1000;

/// Longest time without a tick before the hang guard performs the emergency stop, in ms. It exceeds the overrun that the
/// supervisor tolerates, so that a late control task still reports its overrun itself.
pub const LONGEST_HANG_MS: u32 = WATCHDOGS.hang_ms;

/// Time without a complete round of the task watchdog after which the output is disabled, in ms.
pub const LONGEST_STALL_MS: u32 = WATCHDOGS.stall_ms;

/// Period of the hardware watchdog, in ms. It resets the chip if it is not fed.
pub const WATCHDOG_MS: u32 = WATCHDOGS.reset_ms;

/// An amplifier for 1000 V, which the source report's requirement (97 % within 0.6 s) needs.
pub const KILOVOLT: Amplifier = Amplifier::up_to(1000.0);
/// The amplifier of this image.
pub const AMPLIFIER: Amplifier = if cfg!(feature = "kilovolt") { KILOVOLT } else { Amplifier::PAPER };
/// The paper's controller with this image's amplifier, without a sensor.
pub const SETTINGS: Settings = paper(AMPLIFIER);
/// The time-optimal controller with this image's amplifier, without a sensor.
#[cfg(feature = "fast")]
pub const FAST: Settings = fast(AMPLIFIER);
/// The robust controller with this image's amplifier, without a sensor.
#[cfg(feature = "robust")]
pub const ROBUST: Settings = robust(AMPLIFIER);

/// Settings of a run that the host commands, unless others are stored.
#[cfg(not(any(feature = "fast", feature = "robust")))]
pub const FLASHED: Settings = with_sensor(SETTINGS);
/// Settings of a run that the host commands, unless others are stored.
#[cfg(all(feature = "fast", not(feature = "robust")))]
pub const FLASHED: Settings = with_sensor(FAST);
/// Settings of a run that the host commands, unless others are stored.
#[cfg(feature = "robust")]
pub const FLASHED: Settings = with_sensor(ROBUST);
/// Correction by the stiffness sensor; it has no effect on a board without one.
#[cfg(not(feature = "feedback"))]
const SENSOR: Option<Feedback> = None;
/// Correction by the stiffness sensor; it has no effect on a board without one.
#[cfg(feature = "feedback")]
const SENSOR: Option<Feedback> = Some(Feedback::TYPICAL);
/// Adaptation of the model to what the isolation bank names.
const ADAPTATION: Option<adaptation::Settings> =
    if cfg!(feature = "adaptation") { Some(adaptation::Settings::TYPICAL) } else { None };
/// Settings of the supervisor, unless others are stored.
pub const SUPERVISION: supervisor::Settings = supervisor::Settings::DEFAULT;

/// Times of the watchdogs, unless others are stored.
pub const WATCHDOGS: Watchdogs = Watchdogs::DEFAULT;
/// All settings of the flashed image.
pub const BUILT_IN: device::Settings = built_in(FLASHED);

/// All settings of an image with the settings `control` of its loop. Without a sensor nothing adapts.
pub const fn built_in(control: Settings) -> device::Settings {
    device::Settings {
        control,
        supervision: SUPERVISION,
        watchdogs: WATCHDOGS,
        trip_on_cause: Causes::NONE,
        tolerance: Tolerance::NONE,
        adaptation: if control.feedback.is_some() { ADAPTATION } else { None },
    }
}

/// The paper's controller with `amplifier`, without a sensor.
pub const fn paper(amplifier: Amplifier) -> Settings {
    Settings { rate_hz: RATE_HZ as f64, amplifier, ..Settings::PAPER }
}

/// The time-optimal controller with `amplifier`, without a sensor.
#[cfg(feature = "fast")]
pub const fn fast(amplifier: Amplifier) -> Settings {
    Settings { compensation: Compensation::TimeOptimal(Approach::DEAD_BEAT), ..paper(amplifier) }
}

/// The robust controller with `amplifier`, without a sensor.
#[cfg(feature = "robust")]
pub const fn robust(amplifier: Amplifier) -> Settings {
    Settings { compensation: Compensation::Robust(Margin::TYPICAL), ..paper(amplifier) }
}

/// `settings` with the correction by the stiffness sensor if the feature `feedback` is enabled.
pub const fn with_sensor(settings: Settings) -> Settings {
    Settings { feedback: SENSOR, ..settings }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_takes_its_amplifier_and_its_sensor_from_its_features_alone() {
        assert_eq!(paper(KILOVOLT), Settings { amplifier: KILOVOLT, ..SETTINGS });
        assert_eq!(with_sensor(SETTINGS), Settings { feedback: SENSOR, ..SETTINGS });
    }

    #[test]
    #[cfg(feature = "fast")]
    fn the_fast_image_differs_from_the_paper_by_its_controller_alone() {
        let compensation = Compensation::TimeOptimal(Approach::DEAD_BEAT);
        assert_eq!(fast(KILOVOLT), Settings { compensation, ..paper(KILOVOLT) });
    }

    #[test]
    #[cfg(feature = "robust")]
    fn the_robust_image_differs_from_the_paper_by_its_controller_alone() {
        let compensation = Compensation::Robust(Margin::TYPICAL);
        assert_eq!(robust(KILOVOLT), Settings { compensation, ..paper(KILOVOLT) });
    }

    /// An image with others would start nothing.
    #[test]
    fn the_settings_that_are_built_in_can_run_at_the_rate_that_is_built_in() {
        assert_eq!(BUILT_IN.rate_hz(), RATE_HZ);
        BUILT_IN.check().unwrap_or_else(|error| panic!("{error}"));
        BUILT_IN.check_adaptation().unwrap_or_else(|error| panic!("{error}"));
    }
}
