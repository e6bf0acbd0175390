//! `KEY=PERCENT`: an error of one parameter of the spring.

use std::str::FromStr;

use anyhow::Result;
use clap::Args;
use model::Margin;
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
pub(super) fn together(option: &str, errors: &[ErrorOf]) -> Result<SpringError> {
    let mut together = SpringError::default();
    for (index, ErrorOf { parameter, error }) in errors.iter().enumerate() {
        if errors[..index].iter().any(|earlier| earlier.parameter == *parameter) {
            bad_input!("{option}: {} twice; expected each parameter once", parameter.name());
        }
        *together.of(*parameter) = *error;
    }
    Ok(together)
}

/// How well the robust controller knows the spring.
#[derive(Args, Debug)]
pub(super) struct Known {
    /// The controller for a spring whose `tau`, `gain` or `share` is known to within this, both ways, 0 to 25 %; repeatable
    #[arg(long, value_name = "KEY=PERCENT", allow_hyphen_values = true)]
    known: Vec<ErrorOf>,
    /// Overshoot that the robust controller may cause, in percent of the step, 0 to 20
    #[arg(long, default_value_t = 2.0, value_name = "PERCENT", allow_negative_numbers = true, requires = "known")]
    overshoot_percent: f64,
    /// Part of a step by which the robust controller may let all springs fall back for a while, in percent, 0 to 50: without a sensor the
    /// slow ones then stay above 97 % earlier, if the share is known better than the time constant
    #[arg(long, default_value_t = 0.0, value_name = "PERCENT", allow_negative_numbers = true, requires = "known")]
    fall_back_percent: f64,
}

impl Known {
    /// The robust controller's margin; `None` without `--known`.
    pub(super) fn margin(&self) -> Result<Option<Margin>> {
        let SpringError { share, time_constant, gain, .. } = together("--known", &self.known)?;
        let (overshoot, fall_back) = (self.overshoot_percent / 100.0, self.fall_back_percent / 100.0);
        Ok((!self.known.is_empty()).then_some(Margin { time_constant, share, gain, overshoot, fall_back }))
    }
}
