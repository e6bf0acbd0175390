//! What an image runs: spring, controller and amplifier, and how they are supervised.

use model::{Amplifier, Feedback, Settings, supervisor};
#[cfg(feature = "fast")]
use model::{Approach, Compensation};

/// Of the amplifier that is driven: to be changed with it.
const AMPLIFIER: Amplifier = Amplifier::PAPER;
/// Of every run under the paper's controller.
pub const SETTINGS: Settings = Settings { amplifier: AMPLIFIER, ..Settings::PAPER };
/// Of every run under the time-optimal controller.
#[cfg(feature = "fast")]
pub const FAST: Settings = Settings { compensation: Compensation::TimeOptimal(Approach::DEAD_BEAT), ..SETTINGS };

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

/// The same with the sensor, if there is one.
const fn sensing(settings: Settings) -> Settings {
    Settings { feedback: SENSOR, ..settings }
}
