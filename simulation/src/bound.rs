//! Lower bound on the time of a step under any controller.
//!
//! The spring's stiffness increases monotonically with its present and past voltage. Therefore no controller is faster
//! than one that drives to the end of the amplifier's range at the slew limit and stays there; from a settled spring
//! the response to that drive has a closed form.
//!
//! An extended spring is seldom settled: it has creep, leakage and hysteresis. For it the drive starts from the state
//! that the voltages applied so far have produced, and the response is computed tick by tick in double precision. The
//! bound then holds unless the spring itself is not monotonic: a falling static law, or a leakage faster than the
//! relaxation.

use crate::reference::Loop;
use crate::run::{Run, Sample};
use crate::sampled::{SampledLoop, spring};
use crate::schedule::Change;

/// Shortest time, in s, from an ideal step command until the stiffness has completed `part` (0 to 1) of the way from a
/// settled `from_v` to `to_v` (V); `None` if the amplifier's range does not suffice.
pub fn shortest_time(system: &Loop, from_v: f64, to_v: f64, part: f64) -> Option<f64> {
    let direction = (to_v - from_v).signum();
    let end_v = if direction > 0.0 { system.range_v.1 } else { system.range_v.0 };
    let travel = (end_v - from_v) * direction;
    let goal = part * (to_v - from_v).abs();
    if goal <= 0.0 {
        return Some(0.0);
    }
    if goal >= travel {
        return None;
    }
    // All voltages below are relative to `from_v`, positive in the direction of the step.
    let tau = system.time_constant_s;
    let ramp_s = travel / system.slew_v_per_s;
    let response = |t: f64| {
        let voltage = if t < ramp_s { system.slew_v_per_s * t } else { travel };
        let ramped = t.min(ramp_s);
        let at_ramp_end = if ramp_s > 0.0 { travel / ramp_s * (ramped + tau * (-ramped / tau).exp_m1()) } else { 0.0 };
        let relaxed = travel + (at_ramp_end - travel) * (-(t - ramped) / tau).exp();
        let relaxed = if t < ramp_s { at_ramp_end } else { relaxed };
        system.share * voltage + (1.0 - system.share) * relaxed
    };
    if response(0.0) >= goal {
        return Some(0.0);
    }
    // After 35 time constants all but 1e-15 of the change is complete.
    let (mut early, mut late) = (0.0, ramp_s + 35.0 * tau);
    for _ in 0..100 {
        let middle = 0.5 * (early + late);
        if response(middle) < goal { early = middle } else { late = middle }
    }
    Some(late)
}

/// Shortest time, in s, for each change of a run, from the state that the voltages of `samples` have produced; `None`
/// if the next change comes first.
pub fn shortest_times_from_state(
    system: &SampledLoop,
    run: &Run,
    samples: &[Sample],
    changes: &[Change],
    part: f64,
) -> Vec<Option<f64>> {
    let spring = &system.spring;
    let mut state = spring.at_rest();
    let mut tick = 0;
    let mut bounds = Vec::new();
    for change in changes {
        // Times may differ from ticks by rounding errors.
        let start_s = change.start_s + 1e-9;
        while tick + 1 < samples.len() && run.time_s(tick + 1) <= start_s {
            spring.apply(&mut state, samples[tick].applied.to_f64());
            spring.hold(&mut state, system.sample_s);
            tick += 1;
        }
        let mut now = state.clone();
        let late_s = change.start_s - run.time_s(tick);
        if late_s > 1e-9 {
            spring.apply(&mut now, samples[tick].applied.to_f64());
            spring.hold(&mut now, late_s);
        }
        let goal = change.from_v + part * (change.to_v - change.from_v);
        let up = change.to_v > change.from_v;
        bounds.push(at_full_drive(system, now, goal, up, change.end_s - change.start_s));
    }
    bounds
}

/// Time in s at which the stiffness passes `goal` (V) under full drive upwards or downwards; `None` if not within
/// `longest_s`.
fn at_full_drive(system: &SampledLoop, mut state: spring::State, goal: f64, up: bool, longest_s: f64) -> Option<f64> {
    let spring = &system.spring;
    let step_v = system.slew_v_per_s * system.sample_s;
    let there = |state: &spring::State| (spring.stiffness(state) >= goal) == up;
    let mut passed = 0.0;
    while passed < longest_s {
        let voltage = state.voltage();
        spring.apply(
            &mut state,
            if up { voltage + step_v } else { voltage - step_v }.clamp(system.range_v.0, system.range_v.1),
        );
        if there(&state) {
            return Some(passed);
        }
        let after = |seconds: f64| {
            let mut later = state.clone();
            spring.hold(&mut later, seconds);
            later
        };
        let next = after(system.sample_s);
        if there(&next) {
            let (mut early, mut late) = (0.0, system.sample_s);
            for _ in 0..40 {
                let middle = 0.5 * (early + late);
                if there(&after(middle)) { late = middle } else { early = middle }
            }
            return Some(passed + late);
        }
        (state, passed) = (next, passed + system.sample_s);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampled::Controller;

    fn paper(limit_v: f64, slew_v_per_s: f64) -> Loop {
        Loop { share: 1.0 / 11.0, time_constant_s: 5.5, gains: None, range_v: (0.0, limit_v), slew_v_per_s }
    }

    #[test]
    fn without_slew_the_bound_is_the_closed_form() {
        for (limit, expected) in [(700.0, 1.62), (1000.0, 0.446)] {
            let got = shortest_time(&paper(limit, f64::INFINITY), 400.0, 500.0, 0.97).unwrap();
            let exact = 5.5 * (10.0 / 11.0 * (limit - 400.0) / (limit - 497.0)).ln();
            assert!((got - exact).abs() < 1e-9 && (got - expected).abs() < 0.005, "{limit}: {got} {exact}");
        }
        assert_eq!(shortest_time(&paper(490.0, f64::INFINITY), 400.0, 500.0, 0.97), None);
        // Downwards is not the mirror image of upwards: the range ends at 0 V.
        assert_eq!(shortest_time(&paper(700.0, f64::INFINITY), 100.0, 0.0, 1.0), None);
        let down = shortest_time(&paper(700.0, f64::INFINITY), 500.0, 400.0, 0.97).unwrap();
        assert!((down - 5.5 * (10.0 / 11.0 * 500.0 / 403.0f64).ln()).abs() < 1e-9);
    }

    /// A settled plain spring is a special case of a spring in a given state.
    #[test]
    fn from_a_settled_state_the_bound_is_the_closed_form() {
        let samples: Vec<Sample> = (0..70_000)
            .map(|tick| Sample {
                code: model::DacCode(0),
                applied: model::Volts::new(if tick < 60_000 { 400.0 } else { 500.0 }).unwrap(),
                stiffness: model::ScaledStiffness::default(),
                limits: model::Limits::NONE,
                reference: 0.0,
            })
            .collect();
        let run = Run { start_s: 0.0, rate_hz: 1000.0, with: Vec::new(), without: Vec::new() };
        let change = Change { start_s: 60.0, end_s: 70.0, from_v: 400.0, to_v: 500.0 };
        for slew_v_per_s in [f64::INFINITY, 2000.0] {
            let system = SampledLoop {
                sample_s: 1e-3,
                spring: model::Plant::PAPER.into(),
                controller: Controller::None,
                range_v: (0.0, 700.0),
                slew_v_per_s,
            };
            let got = shortest_times_from_state(&system, &run, &samples, &[change], 0.97)[0].unwrap();
            let exact = shortest_time(&paper(700.0, slew_v_per_s), 400.0, 500.0, 0.97).unwrap();
            // A tick makes its part of a slew in one jump.
            assert!((got - exact).abs() < 1e-3, "{slew_v_per_s}: {got} {exact}");
        }
    }

    /// The reference reaches the bound if its target is the end of the range.
    #[test]
    fn the_reference_at_full_drive_reaches_the_bound() {
        for slew in [f64::INFINITY, 800.0, 100.0] {
            let system = paper(700.0, slew);
            let time = shortest_time(&system, 0.0, 100.0, 0.97).unwrap();
            let mut solution = system.at_rest(1.0);
            solution.advance(700.0, 0.0, time);
            let stiffness = solution.moment().stiffness;
            assert!((stiffness - 97.0).abs() < 1e-6, "{slew}: {stiffness}");
        }
    }
}
