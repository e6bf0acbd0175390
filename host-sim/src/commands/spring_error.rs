//! `KEY=PERCENT`: an error of one parameter of the spring.

use std::str::FromStr;

use anyhow::Result;
use simulation::bad_input;
use simulation::bad_input::{BadInput, excerpt};
use simulation::spring_error::{Parameter, SpringError};

/// Smallest and largest error of a parameter, in percent.
const PERCENT: (f64, f64) = (-90.0, 900.0);

/// An error of one parameter of the spring.
#[derive(Clone, Copy, Debug)]
pub(super) struct ErrorOf {
    parameter: Parameter,
    /// Relative to the parameter.
    error: f64,
}

impl FromStr for ErrorOf {
    type Err = BadInput;

    fn from_str(text: &str) -> Result<Self, BadInput> {
        let refused = || BadInput(format!("`{}`: expected tau, gain or share, then `=` and -90 to 900", excerpt(text)));
        let (key, percent) = text.split_once('=').ok_or_else(refused)?;
        let parameter = match key {
            "tau" => Parameter::TimeConstant,
            "gain" => Parameter::Gain,
            "share" => Parameter::Share,
            _ => return Err(refused()),
        };
        let percent: f64 = percent.parse().map_err(|_| refused())?;
        let allowed = (PERCENT.0..=PERCENT.1).contains(&percent);
        if allowed { Ok(Self { parameter, error: percent / 100.0 }) } else { Err(refused()) }
    }
}

/// The errors of all parameters.
///
/// # Errors
/// [`BadInput`] for a parameter that is there twice.
pub(super) fn together(errors: &[ErrorOf]) -> Result<SpringError> {
    let mut together = SpringError::default();
    for (index, ErrorOf { parameter, error }) in errors.iter().enumerate() {
        if errors[..index].iter().any(|earlier| earlier.parameter == *parameter) {
            bad_input!("--spring-error: {} twice; expected each parameter once", parameter.name());
        }
        *together.of(*parameter) = *error;
    }
    Ok(together)
}
