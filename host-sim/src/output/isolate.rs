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
    format!("{:>10.2} s  {}", event.time_s, event)
}
