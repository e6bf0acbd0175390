//! What an image runs: spring, controller and amplifier, and how they are supervised.

use model::{Amplifier, Feedback, Settings, supervisor};
#[cfg(feature = "fast")]
use model::{Approach, Compensation};

/// Reaches 1000 V, which the report's requirement takes (97 % within 0.6 s).
pub const KILOVOLT: Amplifier = Amplifier::up_to(1000.0);
/// The one that the image drives.
pub const AMPLIFIER: Amplifier = if cfg!(feature = "kilovolt") { KILOVOLT } else { Amplifier::PAPER };
/// Of every run under the paper's controller.
pub const SETTINGS: Settings = paper(AMPLIFIER);
/// Of every run under the time-optimal controller.
#[cfg(feature = "fast")]
pub const FAST: Settings = fast(AMPLIFIER);

/// Of what a host commands: what is flashed, and the emulated board at its link.
#[cfg(not(feature = "fast"))]
pub const FLASHED: Settings = sensing(SETTINGS);
/// Of what a host commands: what is flashed, and the emulated board at its link.
#[cfg(feature = "fast")]
pub const FLASHED: Settings = sensing(FAST);
/// A stiffness sensor, which corrects nothing until a board has one.
#[cfg(not(feature = "feedback"))]
const SENSOR: Option<Feedback> = None;
/// A stiffness sensor, which corrects nothing until a board has one.
#[cfg(feature = "feedback")]
const SENSOR: Option<Feedback> = Some(Feedback::TYPICAL);
/// Supervision of every run.
pub const SUPERVISION: supervisor::Settings = supervisor::Settings::DEFAULT;

/// Who leads the spring up and down.
#[derive(Debug, PartialEq)]
pub struct Leader {
    /// Name of the run.
    pub run: &'static str,
    /// What the controller is built from.
    pub settings: &'static Settings,
}

/// All that are in the image.
pub static LEADERS: &[Leader] = &[
    Leader { run: "up-down", settings: &SETTINGS },
    #[cfg(feature = "fast")]
    Leader { run: "up-down fast", settings: &FAST },
    #[cfg(feature = "feedback")]
    Leader { run: "up-down sensor", settings: &const { sensing(SETTINGS) } },
    #[cfg(all(feature = "fast", feature = "feedback"))]
    Leader { run: "up-down fast sensor", settings: &const { sensing(FAST) } },
];

/// The paper's controller with this amplifier.
pub const fn paper(amplifier: Amplifier) -> Settings {
    Settings { amplifier, ..Settings::PAPER }
}

/// The time-optimal controller with this amplifier.
#[cfg(feature = "fast")]
pub const fn fast(amplifier: Amplifier) -> Settings {
    Settings { compensation: Compensation::TimeOptimal(Approach::DEAD_BEAT), ..paper(amplifier) }
}

/// The same with the sensor, if there is one.
const fn sensing(settings: Settings) -> Settings {
    Settings { feedback: SENSOR, ..settings }
}
