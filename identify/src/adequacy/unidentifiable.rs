//! Why a record identifies no spring, and what is reported then.

use crate::answer::Verdict;

/// Why no cause is searched for, or none is reported.
#[derive(Clone, Debug, PartialEq)]
pub enum Unidentifiable {
    /// The voltage excites the spring too little, or noise hides its response.
    Excitation,
    /// The reading is the same in every row; the sentence says what the voltage does.
    DeadSensor(String),
    /// The readings are not those of a spring but noise; the sentence says what the voltage does.
    Noise(String),
    /// The command follows the readings, so that an error of the simulation cannot be distinguished from noise in the command.
    Feedback,
}

impl Unidentifiable {
    /// Verdict of the report: `insufficient` for too little excitation, `unexplained` for a sensor that does not read the spring.
    pub(crate) fn verdict(&self) -> Verdict {
        match self {
            Self::Excitation | Self::Feedback => Verdict::Insufficient,
            Self::DeadSensor(_) | Self::Noise(_) => Verdict::Unexplained,
        }
    }

    /// The report's sentence on what the simulation leaves; `None` for too little excitation.
    pub(crate) fn leftover(&self) -> Option<String> {
        match self {
            Self::Excitation => None,
            Self::DeadSensor(what) | Self::Noise(what) => Some(what.clone()),
            Self::Feedback => Some(
                "The command follows the readings, noise included: the record was made in feedback, and what is left of the \
                 readings may be that noise or an error of the simulation"
                    .to_owned(),
            ),
        }
    }

    /// The report's sentence on the experiment that would identify the spring.
    pub(crate) fn next_experiment(&self) -> &'static str {
        match self {
            Self::Excitation => {
                "run a stair over the whole range up and down again, each step held for five time constants: this \
                 record does not identify the gain or the time constant"
            }
            Self::Feedback => "run a schedule that does not depend on the readings",
            Self::DeadSensor(_) => "check the sensor and its cable, then repeat the record",
            Self::Noise(_) => {
                "check that the sensor reads this spring and that voltage and readings are those of one experiment, then \
                 repeat the record"
            }
        }
    }
}
