//! Closed loops as Markdown.

use super::effects::Outcome;
use super::failing::Consequence;
use crate::campaign::aim::Aim;
use crate::campaign::tables::table;
use crate::hidden::Cause;

/// Effects that a sensor has to make good, to within the noise of one reading.
pub const MADE_GOOD: [Cause; 6] = [
    Cause::GainError,
    Cause::StaticNonlinearity,
    Cause::Hysteresis,
    Cause::SecondRelaxation,
    Cause::ChargeLeakage,
    Cause::Drift,
];

/// One row an effect.
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

/// The steady errors that are asked for.
pub fn aims(controller: &str, outcomes: &[Outcome], noise_v: f64) -> Vec<Aim> {
    let asked = |outcome: &&Outcome| outcome.cause.is_some_and(|cause| MADE_GOOD.contains(&cause));
    let aim = |outcome: &Outcome| {
        let name = outcome.cause.map_or("none", Cause::name);
        Aim::at_most(format!("{controller}, {name}: steady error with sensor [V]"), noise_v, outcome.with.steady_v)
    };
    outcomes.iter().filter(asked).map(aim).collect()
}

/// One row a failure.
pub fn failures(consequences: &[Consequence]) -> String {
    let milliseconds =
        |time_s: Option<f64>| time_s.map_or_else(|| "-".to_owned(), |time_s| format!("{:.0}", 1000.0 * time_s));
    let row = |it: &Consequence| {
        vec![
            it.failure.name().to_owned(),
            format!("{}", it.at_s),
            it.failure.fault().map_or_else(|| "none".to_owned(), |fault| format!("{fault:?}")),
            milliseconds(it.seen_s),
            format!("{:.2}", it.moved_v),
            format!("{:.2}", it.bump_v),
            format!("{:.2}", it.healthy_bump_v),
            milliseconds(it.back_s),
        ]
    };
    let header = [
        "readings",
        "from [s]",
        "fault",
        "seen after [ms]",
        "moved the stiffness by [V]",
        "largest change of voltage in a tick [V]",
        "with a good sensor",
        "trusted again after [ms]",
    ];
    table(&header, consequences.iter().map(row))
}
