//! Why a record identifies no spring, and what is reported then.

use crate::answer::Verdict;

/// Why no cause is searched for, or none is reported.
#[derive(Clone, Debug, PartialEq)]
pub enum Unidentifiable {
    /// The voltage excites the spring too little, or noise hides its response.
    Excitation,
    /// The readings are not those of a spring; the sentence says what they do instead.
    Sensor(String),
}

impl Unidentifiable {
    /// Verdict of the report: `insufficient` for too little excitation, `unexplained` for a faulty sensor.
    pub(crate) fn verdict(&self) -> Verdict {
        match self {
            Self::Excitation => Verdict::Insufficient,
            Self::Sensor(_) => Verdict::Unexplained,
        }
    }

    /// The report's sentence on what the simulation leaves; `None` for too little excitation.
    pub(crate) fn leftover(&self) -> Option<String> {
        match self {
            Self::Excitation => None,
            Self::Sensor(what) => Some(what.clone()),
        }
    }

    /// The report's sentence on the experiment that would identify the spring.
    pub(crate) fn next_experiment(&self) -> &'static str {
        match self {
            Self::Excitation => {
                "run a stair over the whole range up and down again, each step held for five time constants: this \
                 record does not identify the gain or the time constant"
            }
            Self::Sensor(_) => {
                "check the sensor, its cable and its unit (volts of equivalent static voltage are expected), then repeat \
                 the record"
            }
        }
    }
}
