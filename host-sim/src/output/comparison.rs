//! A comparison of controllers as text.

use super::terminal::{line, optional, shortest_possible, tidy};
use crate::comparison::{AtLimit, Comparison};

/// One table an amplifier.
pub fn text(comparison: &Comparison) -> String {
    let mut text = String::new();
    for AtLimit { limit_v, steps } in &comparison.limits {
        line(
            &mut text,
            &format!(
                "up to {limit_v:<4} V |            |     t50     t90     t97 | overshoot     peak | shortest possible t97"
            ),
        );
        line(
            &mut text,
            "    step [V] | controller |     [s]     [s]     [s] |       [%]      [V] |                   [s]",
        );
        for step in steps {
            for (name, response) in step.each() {
                line(
                    &mut text,
                    &format!(
                        "{:>4} -> {:<4} | {name:<10} | {:>7} {:>7} {:>7} | {:9.2} {:8.1} | {:>21}",
                        tidy(response.from_v),
                        tidy(response.to_v),
                        optional(response.t50_s, 3),
                        optional(response.t90_s, 3),
                        optional(response.t97_s, 3),
                        response.overshoot_percent,
                        response.peak_v,
                        optional(response.bound_t97_s, 3),
                    ),
                );
            }
        }
        text.push('\n');
    }
    line(&mut text, shortest_possible(comparison.bound_from));
    text
}
