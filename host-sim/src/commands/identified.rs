//! How well a spring is known: by an option, or by the 95 % intervals of an identification.

use std::path::Path;

use anyhow::Result;
use serde::Deserialize;
use simulation::bad_input;
use simulation::bounded_file::read_text;
use simulation::spring_error::{Parameter, SpringError};

use super::spring_error::{ErrorOf, together};

/// Largest error of a parameter, relative.
const LARGEST: f64 = 0.9;
/// Instantaneous share that no step shows, relative to the static gain.
const NEGLIGIBLE: f64 = 0.01;
/// Largest size of an identification, in MiB.
const MOST_MIB: usize = 16;

/// What is read of `vsj identify --json`.
#[derive(Deserialize)]
struct Identified {
    nominal: Nominal,
}

#[derive(Deserialize)]
struct Nominal {
    gain: Interval,
    share: Interval,
    tau_s: Vec<Interval>,
}

#[derive(Deserialize)]
struct Interval {
    value: f64,
    low: f64,
    high: f64,
}

impl Interval {
    /// Half the width, relative to the value.
    fn relative(&self) -> f64 {
        0.5 * (self.high - self.low) / self.value.abs()
    }

    /// The same of an instantaneous share. One that is known to be next to nothing is known well, whatever its relative error.
    fn relative_of_share(&self) -> f64 {
        let is_negligible = self.low.abs().max(self.high.abs()) < NEGLIGIBLE;
        if is_negligible { self.relative().min(LARGEST) } else { self.relative() }
    }
}

/// The intervals of an identification as errors.
fn of_identification(path: &Path) -> Result<SpringError> {
    let text = read_text(path, MOST_MIB, "the JSON of `vsj identify`")?;
    let Identified { nominal } = match serde_json::from_str(&text) {
        Ok(identified) => identified,
        Err(error) => bad_input!("{}: {error}; expected the JSON of `vsj identify`", path.display()),
    };
    Ok(SpringError {
        share: nominal.share.relative_of_share(),
        time_constant: nominal.tau_s.iter().map(Interval::relative).fold(0.0, f64::max),
        gain: nominal.gain.relative(),
    })
}

/// The errors of the file `identified`, which `vsj identify --json` has printed, or without one those that an option gives.
///
/// # Errors
/// [`simulation::BadInput`] for an error that is negative or above 90 %, and for a file that is no identification.
pub(super) fn errors(option: &str, given: &[ErrorOf], identified: Option<&Path>) -> Result<SpringError> {
    let (option, mut spring_error) = match identified {
        Some(path) => ("--identified", of_identification(path)?),
        None => (option, together(option, given)?),
    };
    for parameter in Parameter::ALL {
        let error = *spring_error.of(parameter);
        if !(0.0..=LARGEST).contains(&error) {
            bad_input!("{option}: {} known to {} %; expected 0 to 90", parameter.name(), 100.0 * error);
        }
    }
    Ok(spring_error)
}
