//! The effect of model errors: a controller computed with the nominal spring drives springs that differ from it.
//!
//! Without a sensor the controller cannot detect the difference, so its voltages are those of the nominal run, and only
//! the response of the spring changes. A step is measured from the stiffness at its start.

use model::ScaledStiffness;
use serde::Serialize;

use crate::experiment::{Run, Sample};
use crate::response::from_present;
use crate::sampled;
use crate::spring_error::{DifferingSpring, Parameter, SpringError};
use crate::tune::Specification;
use crate::tune::worst::Worst;

/// Both controllers on a spring that differs from their model.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Trade {
    /// The parameter that differs.
    pub parameter: Parameter,
    /// Relative difference of the spring's parameter from the model's, -0.5 to 0.5.
    pub error: f64,
    /// Worst response with the tuned proportional-integral controller; `None` if there are no gains.
    pub proportional_integral: Option<Worst>,
    /// Worst response with the time-optimal controller.
    pub fast: Option<Worst>,
}

/// Evaluates errors of -50 % to +50 % in steps of 5 %.
pub(super) fn over_model_errors(
    specification: &Specification,
    with_gains: Option<&Run>,
    fast: Option<&Run>,
) -> Vec<Trade> {
    let mut trade = Vec::new();
    for parameter in Parameter::ALL {
        for part in -10..=10 {
            let error = f64::from(part) / 20.0;
            let errors = SpringError::default().with(parameter, error);
            let on = |run: Option<&Run>| run.map(|run| with_errors(specification, &errors, run));
            trade.push(Trade { parameter, error, proportional_integral: on(with_gains), fast: on(fast) });
        }
    }
    trade
}

/// Worst response when the voltages of `run` drive a spring that differs from the specified one by these errors.
pub(super) fn with_errors(specification: &Specification, errors: &SpringError, run: &Run) -> Worst {
    let differing = DifferingSpring::new(specification.file, errors);
    let times: Vec<f64> = (0..run.with.len()).map(|tick| run.time_s(tick)).collect();
    let volts: Vec<f64> = run.with.iter().map(|sample| sample.applied.to_f64()).collect();
    let stiffness = sampled::simulate(&differing.spring(), &times, &volts);
    let answered = |(sample, stiffness): (&Sample, f64)| Sample {
        stiffness: ScaledStiffness(model::units::Signal::saturating_from_num(differing.gain * stiffness)),
        ..*sample
    };
    let samples: Vec<Sample> = run.with.iter().zip(stiffness).map(answered).collect();
    let each = specification
        .stair()
        .changes()
        .into_iter()
        .map(|change| Worst::of_step(run, &samples, &from_present(run, &samples, &change)));
    Worst::of(each)
}
