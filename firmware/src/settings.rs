//! What an image runs: spring, controller and amplifier, and how they are supervised.

#[cfg(feature = "feedback")]
use model::Feedback;
#[cfg(feature = "fast")]
use model::{Approach, Compensation};
use model::{Settings, supervisor};

/// Of every run under the paper's controller.
pub const SETTINGS: Settings = Settings::PAPER;
/// Of what is flashed.
#[cfg(not(feature = "feedback"))]
pub const FLASHED: Settings = SETTINGS;
/// Of what is flashed: with a sensor, which corrects nothing until a board has one.
#[cfg(feature = "feedback")]
pub const FLASHED: Settings = sensing(SETTINGS);
/// Under the time-optimal controller.
#[cfg(feature = "fast")]
const FAST: Settings = Settings { compensation: Compensation::TimeOptimal(Approach::DEAD_BEAT), ..SETTINGS };
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
    Leader { run: "up-down sensor", settings: &FLASHED },
    #[cfg(all(feature = "fast", feature = "feedback"))]
    Leader { run: "up-down fast sensor", settings: &const { sensing(FAST) } },
];

/// The same with a stiffness sensor.
#[cfg(feature = "feedback")]
const fn sensing(settings: Settings) -> Settings {
    Settings { feedback: Some(Feedback::TYPICAL), ..settings }
}
