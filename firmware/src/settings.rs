//! What an image runs: spring, controller and amplifier, and how they are supervised.

#[cfg(feature = "fast")]
use model::{Approach, Compensation};
use model::{Settings, supervisor};

/// Of what is flashed, and of every run under the paper's controller.
pub const SETTINGS: Settings = Settings::PAPER;
/// The same under the time-optimal controller.
#[cfg(feature = "fast")]
const FAST: Settings = Settings { compensation: Compensation::TimeOptimal(Approach::DEAD_BEAT), ..SETTINGS };
/// Supervision of every run.
pub const SUPERVISION: supervisor::Settings = supervisor::Settings::DEFAULT;

/// Who leads the spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leader {
    /// The paper's controller.
    Paper,
    /// The time-optimal one.
    #[cfg(feature = "fast")]
    Fast,
}

impl Leader {
    /// All that are in the image.
    pub const ALL: &[Self] = &[
        Self::Paper,
        #[cfg(feature = "fast")]
        Self::Fast,
    ];

    /// Name of the way up and down under it.
    pub const fn up_down(self) -> &'static str {
        match self {
            Self::Paper => "up-down",
            #[cfg(feature = "fast")]
            Self::Fast => "up-down fast",
        }
    }

    /// What it is built from.
    pub const fn settings(self) -> &'static Settings {
        match self {
            Self::Paper => &SETTINGS,
            #[cfg(feature = "fast")]
            Self::Fast => &FAST,
        }
    }
}
