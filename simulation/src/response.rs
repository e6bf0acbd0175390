//! Characteristics of a loop's response to each change of its target.

use serde::Serialize;

use crate::experiment::{Experiment, HasReference};
use crate::run::{Run, Sample};
use crate::schedule::Change;

/// The response to one change. Times are in s from the start of the change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Response {
    /// Target before the change, in V.
    pub from_v: f64,
    /// Target after the change, in V.
    pub to_v: f64,
    /// Time to 50 % of the change; `None` if the next change comes first.
    pub t50_s: Option<f64>,
    /// Time to 90 % of the change.
    pub t90_s: Option<f64>,
    /// Time to 97 % of the change.
    pub t97_s: Option<f64>,
    /// Largest overshoot, in percent of the change, 0 or more.
    pub overshoot_percent: f64,
    /// Extreme voltage in the direction of the change, in V.
    pub peak_v: f64,
    /// Lower bound on `t97_s` for any controller behind this amplifier, for an ideal step: from a settled spring, or
    /// for an extended spring from the state that this loop has produced (see [`crate::bound`]). `None` if out of
    /// reach.
    pub bound_t97_s: Option<f64>,
}

/// Returns the time from the start of a change after which a loop's stiffness stays above a part of it, in s; `None` if it is below at the
/// end.
pub fn kept(run: &Run, samples: &[Sample], change: &Change, goal: f64) -> Option<f64> {
    let (first, window) = window(run, samples, change);
    let below = window.iter().rposition(|sample| part(change, sample) < goal);
    let after = below.map_or(0, |at| at + 1);
    (after < window.len()).then(|| (run.time_s(first + after) - change.start_s).max(0.0))
}

/// The samples of a change, and the tick of the first.
fn window<'s>(run: &Run, samples: &'s [Sample], change: &Change) -> (usize, &'s [Sample]) {
    let first = run.tick_at(change.start_s);
    // The tick at the end may already belong to the next change.
    let last = run.tick_at(change.end_s).max(first + 1);
    (first, &samples[first..last])
}

/// How much of a change the stiffness has made.
fn part(change: &Change, sample: &Sample) -> f64 {
    (sample.stiffness.to_f64() - change.from_v) / (change.to_v - change.from_v)
}

/// Measures one loop of a run; the stiffness is interpolated linearly between ticks.
pub fn measure(run: &Run, samples: &[Sample], change: &Change, bound_t97_s: Option<f64>) -> Response {
    let Change { start_s, from_v, to_v, .. } = *change;
    let (first, window) = window(run, samples, change);
    let part = |sample: &Sample| part(change, sample);

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
        bound_t97_s,
    }
}

/// Returns the change from the stiffness that a loop has reached when the target changes, instead of from the old target.
pub fn from_present(run: &Run, samples: &[Sample], change: &Change) -> Change {
    // The tick before the target changes.
    let from_v = samples[run.tick_at(change.start_s).saturating_sub(1)].stiffness.to_f64();
    Change { from_v, to_v: from_v + change.to_v - change.from_v, ..*change }
}

/// Responses of one loop of a run to all changes of its target.
pub fn responses<P: HasReference>(experiment: &Experiment<P>, run: &Run, samples: &[Sample]) -> Vec<Response> {
    let changes = experiment.schedule.changes();
    let bounds = P::bounds(&experiment.settings, run, samples, &changes);
    let each = |(change, bound): (&Change, _)| measure(run, samples, change, bound);
    changes.iter().zip(bounds).map(each).collect()
}

#[cfg(test)]
mod tests {
    use model::{DacCode, Limits, ScaledStiffness, Volts};

    use super::*;

    /// A run whose stiffness and voltage are given functions of time.
    fn run(rate_hz: f64, ticks: usize, stiffness: impl Fn(f64) -> f64, voltage: impl Fn(f64) -> f64) -> Run {
        let sample = |tick: usize| {
            let time = 2.0 + tick as f64 / rate_hz;
            Sample {
                code: DacCode(0),
                applied: Volts::new(voltage(time)).unwrap(),
                stiffness: ScaledStiffness(Volts::new(stiffness(time)).unwrap().0),
                limits: Limits::NONE,
                reference: 0.0,
            }
        };
        Run { start_s: 2.0, rate_hz, with: (0..ticks).map(sample).collect(), without: Vec::new() }
    }

    /// Straight lines, at a rate at which no crossing falls on a tick.
    #[test]
    fn crossings_lie_between_ticks() {
        let run = run(333.0, 3330, |t| (50.0 * (t - 3.0)).clamp(0.0, 110.0), |t| if t < 4.0 { 300.0 } else { 100.0 });
        let change = Change { start_s: 3.0, end_s: 8.0, from_v: 0.0, to_v: 100.0 };
        let got = measure(&run, &run.with, &change, Some(0.1));
        for (got, expected) in [(got.t50_s, 1.0), (got.t90_s, 1.8), (got.t97_s, 1.94)] {
            assert!((got.unwrap() - expected).abs() < 1e-5, "{got:?} {expected}");
        }
        assert!((got.overshoot_percent - 10.0).abs() < 1e-3);
        assert_eq!(got.peak_v, 300.0);
    }

    /// A stiffness that is there after 2 s and 97 % of it again after 3.5 s; in the end it is lost.
    #[test]
    fn what_is_lost_again_is_not_kept() {
        let stiffness = |t: f64| if (5.5..6.5).contains(&t) { 80.0 } else { (50.0 * (t - 3.0)).clamp(0.0, 100.0) };
        let run = run(100.0, 900, stiffness, |_| 0.0);
        let change = Change { start_s: 3.0, end_s: 8.0, from_v: 0.0, to_v: 100.0 };
        let kept_s = |change: &Change, goal: f64| kept(&run, &run.with, change, goal);
        assert!((kept_s(&change, 0.97).unwrap() - 3.5).abs() < 0.011);
        assert!((kept_s(&change, 0.7).unwrap() - 1.4).abs() < 0.011);
        assert_eq!(kept_s(&Change { end_s: 6.0, ..change }, 0.97), None);
    }

    /// Downwards, incomplete, and directly followed by the next change, whose first tick does not count.
    #[test]
    fn a_step_down_has_its_peak_below() {
        let stiffness = |t: f64| if t < 5.0 { 300.0 - 30.0 * (t - 3.0).max(0.0) } else { 0.0 };
        let run = run(100.0, 600, stiffness, |t| if t < 4.0 { 50.0 } else { 250.0 });
        let change = Change { start_s: 3.0, end_s: 5.0, from_v: 300.0, to_v: 200.0 };
        let got = measure(&run, &run.with, &change, Some(0.1));
        assert!((got.t50_s.unwrap() - 5.0 / 3.0).abs() < 1e-5);
        assert_eq!((got.t90_s, got.t97_s, got.overshoot_percent, got.peak_v), (None, None, 0.0, 50.0));
        assert_eq!(got.bound_t97_s, Some(0.1));
    }
}
