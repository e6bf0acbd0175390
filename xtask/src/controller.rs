//! Which controller an image has: one image each, with a name of its own.

use firmware::settings::{FAST, SETTINGS};
use model::Settings;

/// Who leads the spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Controller {
    /// The paper's
    Paper,
    /// The time-optimal one, in an image of its own
    Fast,
}

/// Options of commands that are for one of the images.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Who leads the spring
    #[arg(long, value_enum, default_value = "paper")]
    pub(crate) controller: Controller,
}

impl Controller {
    pub(crate) const ALL: [Self; 2] = [Self::Paper, Self::Fast];

    /// Of the firmware's, that it needs.
    pub(crate) const fn features(self) -> &'static [&'static str] {
        match self {
            Self::Paper => &[],
            Self::Fast => &["fast"],
        }
    }

    /// What such an image runs.
    pub(crate) const fn settings(self) -> &'static Settings {
        match self {
            Self::Paper => &SETTINGS,
            Self::Fast => &FAST,
        }
    }
}
