//! The response to one step as columns of a table: times, overshoot, peak, and lower bound on t97.

use crate::output::cells::optional;
use simulation::experiment::StartsFrom;
use simulation::response::Response;

/// Headings of the columns.
pub(super) const NAMES: &str = "    t50     t90     t97 | overshoot     peak | shortest possible t97";
/// Units of the columns.
pub(super) const UNITS: &str = "    [s]     [s]     [s] |       [%]      [V] |                   [s]";

/// The columns of a step.
pub(super) fn columns(step: &Response) -> String {
    format!(
        "{:>7} {:>7} {:>7} | {:9.2} {:8.1} | {:>21}",
        optional(step.t50_s, 3),
        optional(step.t90_s, 3),
        optional(step.t97_s, 3),
        step.overshoot_percent,
        step.peak_v,
        optional(step.bound_t97_s, 3),
    )
}

/// Explains the column of the lower bound.
pub(super) fn shortest_possible(from: StartsFrom) -> &'static str {
    match from {
        StartsFrom::Settled => {
            "Shortest possible: any controller within range and slew, from a spring settled at the old value."
        }
        StartsFrom::Reached => {
            "Shortest possible: any controller within range and slew, from the state in which this loop has left the spring."
        }
    }
}
