//! How well a spring is known: by an option, or by the 95 % intervals of an identification.

use std::path::Path;

use anyhow::Result;
use serde::{Deserialize, Serialize};
use simulation::bad_input;
use simulation::bad_input::number;
use simulation::bounded_file::read_text;
use simulation::spring_error::{Parameter, SpringError};

use super::spring_error::{ErrorOf, together};

/// Largest error of a parameter, relative.
pub(super) const LARGEST: f64 = 0.9;
/// The option that names the file of an identification.
const IDENTIFIED: &str = "--identified";
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
    /// Half the width.
    fn half(&self) -> f64 {
        0.5 * (self.high - self.low)
    }

    /// Half the width, relative to the value.
    fn relative(&self) -> f64 {
        self.half() / self.value.abs()
    }

    /// Half the width of the interval of an instantaneous share, relative to its value. A share that is known to be next to nothing
    /// is known well, whatever its relative error.
    fn relative_of_share(&self) -> f64 {
        let is_negligible = self.low.abs().max(self.high.abs()) < NEGLIGIBLE;
        if is_negligible { self.relative().min(LARGEST) } else { self.relative() }
    }
}

/// What an identification says of its spring.
fn of_file(path: &Path) -> Result<Nominal> {
    let text = read_text(path, MOST_MIB, "the JSON of `vsj identify`")?;
    match serde_json::from_str(&text) {
        Ok(Identified { nominal }) => Ok(nominal),
        Err(error) => bad_input!("{}: {error}; expected the JSON of `vsj identify`", path.display()),
    }
}

impl Nominal {
    /// The intervals as errors, that of the share as it is given.
    fn errors(&self, share: f64) -> SpringError {
        let time_constant = self.tau_s.iter().map(Interval::relative).fold(0.0, f64::max);
        SpringError { share, time_constant, gain: self.gain.relative(), ..SpringError::default() }
    }
}

/// The errors of the file `identified`, which `vsj identify --json` has printed, or without one those that an option gives; each relative to
/// its parameter.
///
/// # Errors
/// [`simulation::BadInput`] for an error that is negative or above 90 %, and for a file that is no identification.
pub(super) fn errors(option: &str, given: &[ErrorOf], identified: Option<&Path>) -> Result<SpringError> {
    match identified {
        None => checked(option, together(option, given)?, LARGEST),
        Some(path) => {
            let nominal = of_file(path)?;
            checked(IDENTIFIED, nominal.errors(nominal.share.relative_of_share()), LARGEST)
        }
    }
}

/// The errors of the file `identified`, at most `largest` each, or without one those that an option gives; each relative to its parameter,
/// but that of a share that is not known to 90 % of itself, which is a part of the response.
///
/// # Errors
/// [`simulation::BadInput`] for another error that is negative or too large, and for a file that is no identification.
pub(super) fn errors_with_small_shares(
    option: &str,
    given: &[ErrorOf],
    identified: Option<&Path>,
    largest: f64,
) -> Result<SpringError> {
    match identified {
        None => checked(option, together(option, given)?, LARGEST),
        Some(path) => with_small_share(&of_file(path)?, largest),
    }
}

/// True if `vsj bound` takes the intervals of an identification, which is given as it is printed, as errors.
pub(super) fn bounds_take(identification: &impl Serialize) -> bool {
    let read = serde_json::to_value(identification).and_then(serde_json::from_value);
    read.is_ok_and(|Identified { nominal }| with_small_share(&nominal, LARGEST).is_ok())
}

fn with_small_share(nominal: &Nominal, largest: f64) -> Result<SpringError> {
    let SpringError { time_constant, gain, .. } = checked(IDENTIFIED, nominal.errors(0.0), largest)?;
    let relative = nominal.share.relative();
    let of_itself = (0.0..=LARGEST).contains(&relative);
    let (share, share_of_response) = if of_itself { (relative, 0.0) } else { (0.0, nominal.share.half()) };
    if !(0.0..=1.0).contains(&share_of_response) {
        let percent = number(100.0 * share_of_response);
        bad_input!("{IDENTIFIED}: share known to {percent} % of the response; expected 0 to 100");
    }
    Ok(SpringError { share, time_constant, gain, share_of_response })
}

/// Checks that each relative error of an option is between 0 and a largest one.
fn checked(option: &str, mut spring_error: SpringError, largest: f64) -> Result<SpringError> {
    for parameter in Parameter::ALL {
        let error = *spring_error.of(parameter);
        if !(0.0..=largest).contains(&error) {
            let [percent, most] = [error, largest].map(|error| number(100.0 * error));
            bad_input!("{option}: {} known to {percent} %; expected 0 to {most}", parameter.name());
        }
    }
    Ok(spring_error)
}
