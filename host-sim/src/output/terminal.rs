//! A report as text.

use std::fmt::Write;

use crate::response::Response;
use crate::stair::{Report, Row};

/// The rows beside what was printed and measured, what does not agree and why, and the steps.
pub fn text(report: &Report) -> String {
    let mut text = String::new();
    rows(&mut text, &report.rows);
    if report.printed_compared > 0 {
        let Report { printed_compared, printed_agree, .. } = report;
        line(
            &mut text,
            &format!("\n{printed_agree} of {printed_compared} printed numbers agree to the last digit (truncated)."),
        );
        for row in &report.rows {
            if let Some(note) = &row.note {
                line(&mut text, &format!("  t = {} s, {note}.", row.time_s));
            }
        }
    }
    line(
        &mut text,
        &format!("Fixed point stays within {:.4} V of the reference at every tick.\n", report.max_fixed_point_error),
    );
    steps(&mut text, &report.steps);
    text
}

/// Rows on the terminal; a long file is not printed whole.
const MOST_ROWS: usize = 40;

fn rows(text: &mut String, rows: &[Row]) {
    line(text, "               |       with controller        |      without controller      |");
    line(text, " time   target |  printed reference fixed-pt. |  printed reference fixed-pt. | measured");
    line(text, "  [s]      [V] |      [V]       [V]       [V] |      [V]       [V]       [V] |      [V]");
    for row in rows.iter().take(MOST_ROWS) {
        let mark = if row.note.is_some() { " *" } else { "" };
        line(
            text,
            &format!(
                "{:5} {:8} | {:>8} {:9.3} {:9.3} | {:>8} {:9.3} {:9.3} | {:>8}{mark}",
                row.time_s,
                row.voltage_v,
                optional(row.printed_with, 2),
                row.with,
                row.with_fixed,
                optional(row.printed_without, 2),
                row.without,
                row.without_fixed,
                optional(row.measured, 0),
            ),
        );
    }
    if rows.len() > MOST_ROWS {
        line(text, &format!("  ... and {} more rows", rows.len() - MOST_ROWS));
    }
}

fn steps(text: &mut String, steps: &[Response]) {
    if steps.is_empty() {
        line(text, "No step between two plateaus of at least 1 s.");
        return;
    }
    line(text, "       step |     t50     t90     t97 | overshoot     peak | shortest possible t97");
    line(text, "        [V] |     [s]     [s]     [s] |       [%]      [V] |                   [s]");
    for step in steps {
        line(
            text,
            &format!(
                "{:4} -> {:3} | {:>7} {:>7} {:>7} | {:9.2} {:8.1} | {:>21}",
                step.from_v,
                step.to_v,
                optional(step.t50_s, 3),
                optional(step.t90_s, 3),
                optional(step.t97_s, 3),
                step.overshoot_percent,
                step.peak_v,
                optional(step.bound_t97_s, 3),
            ),
        );
    }
}

fn optional(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}

fn line(text: &mut String, line: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{}", line.trim_end());
}
