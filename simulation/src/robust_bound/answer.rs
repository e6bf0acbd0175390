//! The bounds of the steps of a stair, and how well the spring has to be known for a time.

use anyhow::Result;
use model::{SampleTime, Validate};
use serde::Serialize;

use super::{Allowed, RobustBound};
use crate::bad_input::BadInput;
use crate::plant_file::PlantFile;
use crate::schedule::Schedule;
use crate::spring_error::{Parameter, SpringError};

/// Multiple of its own shortest time in which the nominal spring is at 97 % for [`Step::nominal_first_s`].
pub const OF_KNOWN: f64 = 1.05;

/// Instantaneous share of which a relative error says little.
const SMALL_SHARE: f64 = 0.01;

/// What is asked of [`answer`].
#[derive(Clone, Copy, Debug)]
pub struct Question {
    /// Amplifier and overshoot.
    pub allowed: Allowed,
    /// Largest relative errors of the parameters, both ways, 0 or more.
    pub spring_error: SpringError,
    /// Time in which all steps have to be done, in s.
    pub within_s: f64,
}

/// The answer of `vsj bound --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Answer {
    /// Highest voltage of the amplifier, in V.
    pub limit_v: f64,
    /// Slew limit of the amplifier, in V/s; `None` without one.
    pub slew_v_per_s: Option<f64>,
    /// Largest overshoot, in percent of the step.
    pub overshoot_percent: f64,
    /// Relative errors to within which the spring is known.
    pub spring_error: SpringError,
    /// The steps of the stair.
    pub steps: Vec<Step>,
    /// Time in which all steps have to be done, in s.
    pub within_s: f64,
    /// How well each parameter alone has to be known for it.
    pub needed: Needed,
}

/// Shortest times of one step, from rest.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Step {
    /// Voltage before the step, in V.
    pub from_v: f64,
    /// Voltage that holds the stiffness after the step, in V.
    pub to_v: f64,
    /// Shortest t97 if the spring is known exactly, in s; `None` if out of reach.
    pub known_s: Option<f64>,
    /// Shortest t97 for all springs within the errors, in s; `None` if out of reach.
    pub t97_s: Option<f64>,
    /// Shortest t97 for all springs within the errors, in s, if the nominal one stays above 97 % from [`OF_KNOWN`] times `known_s` on;
    /// `None` if out of reach.
    pub nominal_first_s: Option<f64>,
}

/// Largest relative errors, both ways; `None` if the time is too short even without errors.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Needed {
    /// Largest relative error of the instantaneous share.
    pub share: Option<f64>,
    /// Largest error of an instantaneous share that is near 0, as a part of the response; `None` also for another share.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share_of_response: Option<f64>,
    /// Largest relative error of all time constants.
    pub time_constant: Option<f64>,
    /// Largest relative error of the gain of the whole response.
    pub gain: Option<f64>,
}

impl Needed {
    /// The errors with which all steps of the ideal stair, of `step_v` each, take at most `within_s`.
    pub fn of(bound: &RobustBound<'_>, within_s: f64, step_v: f64) -> Self {
        let steps = steps(step_v);
        let of = |parameter| bound.needed(parameter, within_s, &steps);
        let of_response = || bound.needed_of_response(within_s, &steps);
        let share_of_response = (bound.file.relaxation.share < SMALL_SHARE).then(of_response).flatten();
        Self {
            share: of(Parameter::Share),
            share_of_response,
            time_constant: of(Parameter::TimeConstant),
            gain: of(Parameter::Gain),
        }
    }
}

/// Voltages in V before and after each step of the ideal stair, of `step_v` each.
fn steps(step_v: f64) -> Vec<(f64, f64)> {
    Schedule::ideal_stair_of(step_v).changes().iter().map(|change| (change.from_v, change.to_v)).collect()
}

/// Computes the bounds of the stair's steps and the errors that a time allows.
///
/// # Errors
/// The errors of [`RobustBound::new`], and [`crate::BadInput`] for an amplifier that the model rejects.
pub fn answer(file: &PlantFile, question: &Question) -> Result<Answer> {
    let Question { allowed, spring_error, within_s } = *question;
    // The rate has no part in it.
    allowed.amplifier.validate(SampleTime::from_rate(1000.0).map_err(BadInput::from)?).map_err(BadInput::from)?;
    let bound = RobustBound::new(file, allowed)?;
    let step_v = file.stair_step_v(allowed.amplifier);
    let of = |&(from_v, to_v): &(f64, f64)| {
        let known_s = bound.shortest_s(from_v, to_v, &SpringError::default());
        let (t97_s, nominal_first_s) = if spring_error == SpringError::default() {
            (known_s, known_s)
        } else {
            let nominal_s = known_s.map(|known_s| OF_KNOWN * known_s);
            let first = |nominal_s| bound.shortest_with_nominal_s(from_v, to_v, &spring_error, nominal_s);
            (bound.shortest_s(from_v, to_v, &spring_error), nominal_s.and_then(first))
        };
        Step { from_v, to_v, known_s, t97_s, nominal_first_s }
    };
    Ok(Answer {
        limit_v: allowed.amplifier.max_v,
        slew_v_per_s: allowed.amplifier.slew_v_per_s,
        overshoot_percent: 100.0 * allowed.overshoot,
        spring_error,
        steps: steps(step_v).iter().map(of).collect(),
        within_s,
        needed: Needed::of(&bound, within_s, step_v),
    })
}
