//! The trace of `vsj isolate` as text.

use simulation::isolation::trace::{Event, Trace};

use crate::output::cells::line;

/// One line for each change of what the bank says.
pub fn text(trace: &Trace) -> String {
    let mut text = String::new();
    line(&mut text, &format!("noise of a reading {:.3} V, blocks of {} s", trace.noise_v, trace.block_s));
    trace.trace.iter().for_each(|event| line(&mut text, &describe(event)));
    line(&mut text, &format!("at the end: {}", describe(&trace.last).trim_start()));
    text
}

fn describe(event: &Event) -> String {
    format!("{:>10.2} s  {}", event.time_s, said(event))
}

/// What the bank says: verdict, cause, size, part of the energy, beginning.
pub fn said(event: &Event) -> String {
    let mut text = event.verdict.to_owned();
    match (event.cause, event.other) {
        (Some(cause), Some(other)) => text += &format!(" {cause} or {other}"),
        (Some(cause), None) => text += &format!(" {cause}"),
        _ => {}
    }
    if let Some(size) = event.size {
        let unit = if size.unit.is_empty() { String::new() } else { format!(" {}", size.unit) };
        text += &format!(", size {:.4}{unit} ({:.4} to {:.4})", size.value, size.low, size.high);
    }
    if let Some(explained) = event.explained {
        text += &format!(", explains {:.2} %", 100.0 * explained);
    }
    if let Some(since_s) = event.since_s {
        text += &format!(", since {since_s:.2} s");
    }
    text
}
