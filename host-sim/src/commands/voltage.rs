//! What the voltage did between two rows of a file, as options.

use clap::ValueEnum;

/// How `vsj stair` takes the voltage between two rows of a schedule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Between {
    /// It stays at the earlier row's
    #[default]
    Hold,
    /// It goes straight to the later row's
    Linear,
}

impl From<Between> for simulation::schedule::Between {
    fn from(between: Between) -> Self {
        match between {
            Between::Hold => Self::Hold,
            Between::Linear => Self::Linear,
        }
    }
}

/// How `vsj diagnose` takes the voltage between two rows of a record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Input {
    /// It stayed at the earlier row's
    #[default]
    Hold,
    /// It went straight to the later row's
    Linear,
    /// The report's stair, with its 0.1 s ramps
    Stair,
}

impl From<Input> for identify::Input {
    fn from(input: Input) -> Self {
        match input {
            Input::Hold => Self::Hold,
            Input::Linear => Self::Linear,
            Input::Stair => Self::Stair,
        }
    }
}
