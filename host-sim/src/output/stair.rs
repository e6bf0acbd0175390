//! The answer of `vsj stair` as text.

use crate::output::cells::{line, optional, tidy};
use crate::output::step_response;
use paper::stair::{self, LimitedTicks, Row};
use simulation::experiment::StartsFrom;
use simulation::response::Response;

/// The rows compared with printed and measured values, explanations of differences, and the steps. If the loop is not
/// `controlled`, the steps are those without a controller, and the rows compare them with the report's controller.
pub fn text(report: &stair::Report, controlled: bool) -> String {
    let mut text = String::new();
    rows(&mut text, &report.rows, if controlled { "with controller" } else { "with paper controller" });
    if report.printed_compared > 0 {
        let stair::Report { printed_compared, printed_agree, .. } = report;
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
    let stair::Report { max_fixed_point_error, max_fixed_point_error_without, limited_ticks, .. } = report;
    line(
        &mut text,
        &format!(
            "Fixed point stays within {max_fixed_point_error:.4} V of the reference at every tick \
             (without controller {max_fixed_point_error_without:.4} V)."
        ),
    );
    let LimitedTicks { upper, lower, slew } = limited_ticks;
    if upper + lower + slew > 0 {
        line(
            &mut text,
            &format!("Limits acted: range {upper} ticks at its upper end, {lower} at its lower; slew {slew} ticks."),
        );
    }
    text.push('\n');
    steps(&mut text, &report.steps, report.bound_from);
    text
}

/// Largest number of rows on the terminal.
const MOST_ROWS: usize = 40;

/// The table of rows; columns of printed and measured values only where there are any.
fn rows(text: &mut String, rows: &[Row], with: &str) {
    let printed = rows.iter().any(|row| row.printed_with.is_some());
    let measured = rows.iter().any(|row| row.measured.is_some());
    let of_loop = |name: &str| if printed { format!("{name:^30}|") } else { format!("{name:^21}|") };
    let column = |text: &str| if printed { format!(" {text:>8}") } else { String::new() };
    let both = |texts: [&str; 3]| format!("{} {:>9} {:>9} |", column(texts[0]), texts[1], texts[2]);
    let last = |text: &str| if measured { format!(" {text:>8}") } else { String::new() };
    let names = both(["printed", "reference", "fixed-pt."]);
    let units = both(["[V]", "[V]", "[V]"]);
    line(text, &format!("               |{}{}", of_loop(with), of_loop("without controller")));
    line(text, &format!(" time   target |{names}{names}{}", last("measured")));
    line(text, &format!("  [s]      [V] |{units}{units}{}", last("[V]")));
    for row in rows.iter().take(MOST_ROWS) {
        let mark = if row.note.is_some() { " *" } else { "" };
        let of = |printed: Option<f64>, reference: f64, fixed: f64| {
            both([&optional(printed, 2), &format!("{reference:.3}"), &format!("{fixed:.3}")])
        };
        line(
            text,
            &format!(
                "{:5} {:8} |{}{}{}{mark}",
                tidy(row.time_s),
                tidy(row.voltage_v),
                of(row.printed_with, row.with, row.with_fixed),
                of(row.printed_without, row.without, row.without_fixed),
                last(&optional(row.measured, 0)),
            ),
        );
    }
    if rows.len() > MOST_ROWS {
        line(text, &format!("  ... and {} more rows", rows.len() - MOST_ROWS));
    }
}

fn steps(text: &mut String, steps: &[Response], bound_from: StartsFrom) {
    if steps.is_empty() {
        line(text, "No step between two plateaus of at least 1 s.");
        return;
    }
    line(text, &format!("       step | {}", step_response::NAMES));
    line(text, &format!("        [V] | {}", step_response::UNITS));
    for step in steps {
        let columns = step_response::columns(step);
        line(text, &format!("{:4} -> {:3} | {columns}", tidy(step.from_v), tidy(step.to_v)));
    }
    if steps.iter().any(|step| step.bound_t97_s.is_some()) {
        line(text, step_response::shortest_possible(bound_from));
    }
}
