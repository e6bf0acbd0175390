//! The worst response among the steps of a stair.

use serde::Serialize;

/// The largest t97 and the largest overshoot among the steps of a stair; they may belong to different steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// Longest time from the change of the target to 97 % of it, in s; `None` if a step does not reach 97 %.
    pub t97_s: Option<f64>,
    /// Largest overshoot, in percent of its step, 0 or more.
    pub overshoot_percent: f64,
}

impl Worst {
    /// Takes the worst of `steps`, pairs of t97 in s and overshoot in percent.
    pub(super) fn of(steps: impl Iterator<Item = (Option<f64>, f64)>) -> Self {
        let start = Self { t97_s: Some(0.0), overshoot_percent: 0.0 };
        steps.fold(start, |worst, (t97_s, overshoot)| Self {
            t97_s: worst.t97_s.zip(t97_s).map(|(one, other)| f64::max(one, other)),
            overshoot_percent: worst.overshoot_percent.max(overshoot),
        })
    }
}
