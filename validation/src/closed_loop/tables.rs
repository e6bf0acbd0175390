//! Results of the closed loop as Markdown, and their acceptance criteria.

use super::effects::{CORRECTED, Outcome};
use super::sensor_failure::FailureResponse;
use crate::criterion::Criterion;
use crate::ground_truth::Cause;
use crate::markdown::table;

/// Table with one row for each effect.
pub fn effects(outcomes: &[Outcome]) -> String {
    let row = |outcome: &Outcome| {
        let Outcome { cause, without, with, trusted } = outcome;
        let mut cells = vec![cause.map_or("none", Cause::name).to_owned()];
        cells.extend([without, with].map(|it| format!("{:.2}", it.steady_v)));
        cells.extend([without, with].map(|it| it.t97_s.map_or_else(|| "-".to_owned(), |time| format!("{time:.2}"))));
        cells.extend([without, with].map(|it| format!("{:.1}", it.overshoot_percent)));
        cells.push(format!("{:.1}", 100.0 * trusted));
        cells
    };
    let header = [
        "effect",
        "steady error without [V]",
        "with",
        "t97 without [s]",
        "with",
        "overshoot without [%]",
        "with",
        "trusted [% of the time]",
    ];
    table(&header, outcomes.iter().map(row))
}

/// Criteria of the steady errors that a sensor has to correct.
pub fn criteria(controller: &str, outcomes: &[Outcome], noise_v: f64) -> Vec<Criterion> {
    let required = |outcome: &&Outcome| outcome.cause.is_some_and(|cause| CORRECTED.contains(&cause));
    let criterion = |outcome: &Outcome| {
        let name = outcome.cause.map_or("none", Cause::name);
        Criterion::at_most(
            format!("{controller}, {name}: steady error with sensor [V]"),
            noise_v,
            outcome.with.steady_v,
        )
    };
    outcomes.iter().filter(required).map(criterion).collect()
}

/// Table with one row for each failure.
pub fn failures(responses: &[FailureResponse]) -> String {
    let milliseconds =
        |time_s: Option<f64>| time_s.map_or_else(|| "-".to_owned(), |time_s| format!("{:.0}", 1000.0 * time_s));
    let row = |it: &FailureResponse| {
        vec![
            it.failure.name().to_owned(),
            format!("{}", it.at_s),
            it.failure.fault().map_or_else(|| "none".to_owned(), |fault| format!("{fault:?}")),
            milliseconds(it.detected_s),
            format!("{:.2}", it.moved_v),
            format!("{:.2}", it.bump_v),
            format!("{:.2}", it.healthy_bump_v),
            milliseconds(it.trusted_again_s),
        ]
    };
    let header = [
        "readings",
        "from [s]",
        "fault",
        "detected after [ms]",
        "deviation until then [V]",
        "largest change of voltage in a tick [V]",
        "with a good sensor",
        "trusted again after [ms]",
    ];
    table(&header, responses.iter().map(row))
}
