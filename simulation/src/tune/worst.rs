//! The worst response among the steps of a stair.

use serde::Serialize;

use crate::response::{kept, measure};
use crate::run::{Run, Sample};
use crate::schedule::Change;

/// The largest times and the largest overshoot among the steps of a stair; they may belong to different steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// Longest time from the change of the target to 97 % of it, in s; `None` if a step does not reach 97 %.
    pub t97_s: Option<f64>,
    /// Longest time after which a step stays above 97 %, in s; `None` if it is below at the end. What `vsj bound` is a bound of.
    pub kept97_s: Option<f64>,
    /// Largest overshoot, in percent of its step, 0 or more.
    pub overshoot_percent: f64,
}

impl Worst {
    /// Measures one step.
    pub(super) fn of_step(run: &Run, samples: &[Sample], change: &Change) -> Self {
        let response = measure(run, samples, change, None);
        let kept97_s = kept(run, samples, change, 0.97);
        Self { t97_s: response.t97_s, kept97_s, overshoot_percent: response.overshoot_percent }
    }

    /// Takes the worst of each value among `steps`.
    pub(super) fn of(steps: impl Iterator<Item = Self>) -> Self {
        let start = Self { t97_s: Some(0.0), kept97_s: Some(0.0), overshoot_percent: 0.0 };
        let later = |one: Option<f64>, other: Option<f64>| one.zip(other).map(|(one, other)| f64::max(one, other));
        steps.fold(start, |worst, step| Self {
            t97_s: later(worst.t97_s, step.t97_s),
            kept97_s: later(worst.kept97_s, step.kept97_s),
            overshoot_percent: worst.overshoot_percent.max(step.overshoot_percent),
        })
    }
}
