//! The panels below the plots: values, state, ticks.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};

use super::bad;
use crate::link::{Row, StatusReport};
use crate::watch::view::View;

/// Widths of the panels with their borders, in columns.
const VALUES: u16 = 24;
const STATE: u16 = 24;
const TICKS: u16 = 30;

/// A line of a panel: a name, what it says, and whether that needs attention.
struct Entry(&'static str, String, bool);

pub(super) fn draw(view: &View, frame: &mut Frame<'_>, area: Rect) {
    let row = Row::new(&view.sample, view.status.rate_hz);
    let report = StatusReport::new(&view.status, None, None, None);
    let firmware = format!("Firmware {}", report.firmware);
    let all = [
        (VALUES, format!("Now, {} controller", report.controller), values(view, &row)),
        (STATE, "State".to_owned(), state(view, &row)),
        (TICKS, firmware, ticks(view, &row, &report)),
    ];
    let mut used = 0;
    let fitting: Vec<_> = all
        .into_iter()
        .take_while(|(width, ..)| {
            used += width;
            used <= area.width
        })
        .collect();
    let areas = Layout::horizontal(fitting.iter().map(|(width, ..)| Constraint::Fill(*width))).split(area);
    for ((_, title, entries), area) in fitting.into_iter().zip(areas.iter()) {
        let lines: Vec<Line> = entries.into_iter().map(line).collect();
        frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(format!(" {title} "))), *area);
    }
}

/// The values for a terminal without room for panels.
pub(super) fn in_a_line(view: &View) -> Vec<Line<'static>> {
    let row = Row::new(&view.sample, view.status.rate_hz);
    values(view, &row).into_iter().map(line).collect()
}

fn line(Entry(name, text, is_bad): Entry) -> Line<'static> {
    let style = if is_bad { bad() } else { Style::new().add_modifier(Modifier::BOLD) };
    Line::from(vec![Span::raw(format!(" {name:<9}")), Span::styled(text, style)])
}

fn values(view: &View, row: &Row) -> Vec<Entry> {
    let volts = |value: f64| format!("{value:9.3} V");
    let measured = match row.measured_v {
        Some(value) => volts(value),
        None if row.sensor == "none" => "no sensor".to_owned(),
        None => "no reading".to_owned(),
    };
    let (lowest, highest) = (view.status.lowest.to_f64(), view.status.highest.to_f64());
    vec![
        Entry("target", volts(row.target_v), false),
        Entry("applied", volts(row.applied_v), false),
        Entry("estimate", volts(row.estimate_v), false),
        Entry("measured", measured, false),
        Entry("reach", format!("{lowest} to {highest} V"), false),
    ]
}

fn state(view: &View, row: &Row) -> Vec<Entry> {
    let limits = if row.limits.is_empty() { "none".to_owned() } else { row.limits.join("+") };
    let fault = view.fault().map_or_else(|| "none".to_owned(), |fault| fault.to_string());
    let last = view.status.last_fault;
    let last_fault = if last == link::Fault::NONE { "none".to_owned() } else { last.to_string() };
    vec![
        Entry("fault", fault, view.fault().is_some()),
        Entry("limits", limits, false),
        Entry("monitors", row.monitors.to_owned(), row.monitors != "none"),
        Entry("sensor", row.sensor.to_owned(), !["none", "trusted"].contains(&row.sensor)),
        Entry("at reset", last_fault, last != link::Fault::NONE),
    ]
}

fn ticks(view: &View, row: &Row, report: &StatusReport) -> Vec<Entry> {
    let rates = view.rates();
    let seen = rates.map(|rates| format!(", seen {:.0}", rates.ticks_hz)).unwrap_or_default();
    let samples = rates.map_or_else(|| "-".to_owned(), |rates| format!("{:.0} per s", rates.samples_hz));
    let link = &report.link;
    let damaged = link.damaged + link.oversize + link.bad_version + link.unknown;
    vec![
        Entry("running", format!("{:.1} s", row.time_s), false),
        Entry("rate", format!("{} Hz{seen}", report.rate_hz), false),
        Entry("late", format!("{} ticks", report.overruns), report.overruns > 0),
        Entry("samples", samples, false),
        Entry("lost", format!("{} samples, {damaged} frames", link.telemetry_dropped), damaged > 0),
    ]
}
