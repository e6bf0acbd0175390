//! The answer of `vsj compare` as text.

use crate::output::cells::{line, tidy};
use crate::output::step_response;
use simulation::comparison::{AtLimit, Comparison};

/// One table per amplifier.
pub fn text(comparison: &Comparison) -> String {
    let mut text = String::new();
    for AtLimit { limit_v, steps } in &comparison.limits {
        line(&mut text, &format!("up to {limit_v:<4} V |            | {}", step_response::NAMES));
        line(&mut text, &format!("    step [V] | controller | {}", step_response::UNITS));
        for step in steps {
            for (name, response) in step.each() {
                let (from_v, to_v) = (tidy(response.from_v), tidy(response.to_v));
                let columns = step_response::columns(response);
                line(&mut text, &format!("{from_v:>4} -> {to_v:<4} | {name:<10} | {columns}"));
            }
        }
        text.push('\n');
    }
    line(&mut text, step_response::shortest_possible(comparison.bound_from));
    text
}
