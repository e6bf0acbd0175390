//! How a loop answers each change of its target.

use serde::Serialize;

use crate::bound::shortest_time;
use crate::experiment::{Run, Sample};
use crate::reference::Loop;
use crate::schedule::Change;

/// The answer to one change. Times are in s from the moment the target starts to change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Response {
    /// The plateau before, in V.
    pub from_v: f64,
    /// The plateau after, in V.
    pub to_v: f64,
    /// When half of the change is first reached; `None` if never before the next change.
    pub t50_s: Option<f64>,
    /// When 90 % is first reached.
    pub t90_s: Option<f64>,
    /// When 97 % is first reached.
    pub t97_s: Option<f64>,
    /// How far the stiffness goes beyond, in percent of the change.
    pub overshoot_percent: f64,
    /// The voltage that goes farthest in the direction of the change, in V.
    pub peak_v: f64,
    /// The shortest `t97_s` that any controller could reach within the amplifier's limits, from a settled spring and an
    /// ideal step; `None` if out of reach.
    pub bound_t97_s: Option<f64>,
}

/// Measures one loop of a run, tick by tick, straight between ticks.
pub fn measure(run: &Run, samples: &[Sample], change: &Change, system: &Loop) -> Response {
    let Change { start_s, end_s, from_v, to_v } = *change;
    let first = run.tick_at(start_s);
    // The tick at the end may show the next change already.
    let last = run.tick_at(end_s).max(first + 1);
    let part = |sample: &Sample| (sample.stiffness.to_f64() - from_v) / (to_v - from_v);
    let window = &samples[first..last];

    let reaches = |goal: f64| {
        let after = window.iter().position(|sample| part(sample) >= goal)?;
        let time = |index: usize| run.time_s(first + index) - start_s;
        if after == 0 {
            return Some(time(0).max(0.0));
        }
        let (low, high) = (part(&window[after - 1]), part(&window[after]));
        let missing = (part(&window[after]) - goal) / (high - low);
        Some((time(after) - missing / run.rate_hz).max(0.0))
    };
    let farthest = |value: &dyn Fn(&Sample) -> f64| window.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
    let direction = (to_v - from_v).signum();
    Response {
        from_v,
        to_v,
        t50_s: reaches(0.5),
        t90_s: reaches(0.9),
        t97_s: reaches(0.97),
        overshoot_percent: 100.0 * (farthest(&part) - 1.0).max(0.0),
        peak_v: direction * farthest(&|sample| direction * sample.applied.to_f64()),
        bound_t97_s: shortest_time(system, from_v, to_v, 0.97),
    }
}
