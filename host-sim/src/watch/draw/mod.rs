//! Draws a [`View`] into a terminal of any size.
//!
//! Room is given in this order: state and keys, the values, the plot of the stiffness, the other panels, the plot of the
//! voltage. A terminal too small for a part does without it.

mod axis;
mod help;
mod panels;
mod plot;

use std::path::Path;

use link::State;
use model::adaptation::Phase;
use model::isolation::Verdict;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::view::{Connection, View};
use crate::link::{AdaptationRow, IsolationRow};

/// Height of a panel with its border, in lines.
const PANEL: u16 = 7;
/// Least height of a plot, in lines.
const PLOT: u16 = 6;
/// Least height of two plots, in lines.
const TWO_PLOTS: u16 = 16;

/// Draws the whole screen.
pub fn draw(view: &View, frame: &mut Frame<'_>) {
    let area = frame.area();
    let mut fault = wrapped(&fault(view).unwrap_or_default(), area.width);
    for text in [isolation(view), adaptation(view)].into_iter().flatten() {
        fault.extend(wrapped(&text, area.width));
    }
    let below = 2 + fault.len() as u16;
    let panel = if area.height > PANEL + below { PANEL } else { 0 };
    let [top, plots, panels, warning, note, keys] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Fill(1),
        Constraint::Length(panel),
        Constraint::Length(fault.len() as u16),
        Constraint::Length(1),
        Constraint::Length(1),
    ])
    .areas(area);
    frame.render_widget(header(view, top), top);
    draw_plots(view, frame, plots);
    if panel > 0 {
        panels::draw(view, frame, panels);
    } else {
        frame.render_widget(Paragraph::new(panels::in_a_line(view)), plots);
    }
    let fault: Vec<Line> = fault.into_iter().map(Line::raw).collect();
    frame.render_widget(Paragraph::new(fault).style(bad()), warning);
    frame.render_widget(Paragraph::new(last_line(view)), note);
    frame.render_widget(Paragraph::new(key_line(keys.width)).style(Style::new().add_modifier(Modifier::DIM)), keys);
    if view.shows_help {
        help::draw(view, frame);
    }
}

fn draw_plots(view: &View, frame: &mut Frame<'_>, area: Rect) {
    if area.height >= TWO_PLOTS {
        let [upper, lower] = Layout::vertical([Constraint::Fill(3), Constraint::Fill(2)]).areas(area);
        plot::draw(view, frame, upper, "Stiffness [V]", &[plot::TARGET, plot::ESTIMATE, plot::MEASURED]);
        plot::draw(view, frame, lower, "Applied voltage [V]", &[plot::APPLIED]);
    } else if area.height >= PLOT {
        let all = [plot::APPLIED, plot::TARGET, plot::ESTIMATE, plot::MEASURED];
        plot::draw(view, frame, area, "Stiffness and voltage [V]", &all);
    }
}

/// Style of what needs attention.
fn bad() -> Style {
    Style::new().fg(Color::LightRed).add_modifier(Modifier::BOLD)
}

fn state_style(state: State) -> Style {
    let color = match state {
        State::Disarmed => Color::Green,
        State::Armed => Color::Yellow,
        State::Ramping => Color::Magenta,
        State::Faulted => Color::Red,
    };
    Style::new().fg(color).add_modifier(Modifier::BOLD | Modifier::REVERSED)
}

/// State, port and connection at the left; schedule and recording at the right, if there is room.
fn header(view: &View, area: Rect) -> Line<'static> {
    let state = view.sample.state;
    let mut spans =
        vec![Span::styled(format!(" {} ", state.name().to_uppercase()), state_style(state)), Span::raw(" ")];
    match &view.connection {
        _ if view.is_ending => spans.push(Span::styled(format!("{} ending", view.port), bad())),
        Connection::Connected => spans.push(Span::raw(format!("{} connected", view.port))),
        Connection::Lost(reason) => {
            // Values and state are those of the last moment.
            spans[0] = Span::styled(format!(" WAS {} ", state.name().to_uppercase()), state_style(state));
            spans.push(Span::styled(format!("LOST, reconnecting: {reason}"), bad()));
        }
    }
    let left: usize = spans.iter().map(Span::width).sum();
    let mut room = usize::from(area.width).saturating_sub(left);
    let mut right = String::new();
    for part in activities(view) {
        if part.chars().count() < room {
            room -= part.chars().count();
            right = part + &right;
        }
    }
    if !right.is_empty() {
        spans.push(Span::raw(" ".repeat(room)));
        spans.push(Span::styled(right, Style::new().fg(Color::LightRed)));
    }
    Line::from(spans)
}

/// What goes on besides, the more important first.
fn activities(view: &View) -> impl Iterator<Item = String> {
    let recording = view.recording.as_ref().map(|recording| {
        let lost = if recording.lost > 0 { format!(", {} lost", recording.lost) } else { String::new() };
        format!("  REC {} {} rows{lost} ", recording.file, recording.rows)
    });
    let playing = view.playing.map(|playing| {
        let name = Path::new(&view.schedule).file_name().unwrap_or_default().to_string_lossy();
        format!("  PLAY {name} {:.0} of {:.0} s", playing.elapsed_s, playing.length_s)
    });
    recording.into_iter().chain(playing)
}

/// Breaks a text into lines of at most `width` columns, between words where that is possible.
fn wrapped(text: &str, width: u16) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() + 1 < usize::from(width) => {
                *line = format!("{line} {word}");
            }
            _ => lines.push(format!(" {word}")),
        }
    }
    lines
}

/// The fault that must be acknowledged first, with its remedy, and the others.
fn fault(view: &View) -> Option<String> {
    let fault = view.fault()?;
    let remedy = fault.remedy().map(|remedy| format!(": {remedy}, then k")).unwrap_or_default();
    let others: Vec<String> = view.other_faults().map(|fault| fault.to_string()).collect();
    let others = if others.is_empty() { String::new() } else { format!("; also {}", others.join(", ")) };
    Some(format!("FAULT {fault}{remedy}{others}"))
}

/// What the isolation bank says; `None` if it is quiet or does not run.
fn isolation(view: &View) -> Option<String> {
    let report =
        view.isolation.as_ref().filter(|report| report.verdict().is_some_and(|says| says != Verdict::Quiet))?;
    Some(format!("ISOLATION {}", IsolationRow::new(report, view.status.rate_hz).text()))
}

/// What the adaptation does; `None` if it is watching with the parameters of the stored model, or does not run.
fn adaptation(view: &View) -> Option<String> {
    let report = view.adaptation.as_ref()?;
    let rests = report.phase()? == Phase::Watching && report.ratios == [1.0; 3];
    (!rests).then(|| format!("ADAPTATION {}", AdaptationRow::new(report, view.status.rate_hz).text()))
}

/// What is being typed, or the latest news.
fn last_line(view: &View) -> Line<'static> {
    if let Some(text) = &view.prompt {
        let (lowest, highest) = (view.status.lowest.to_f64(), view.status.highest.to_f64());
        return Line::raw(format!(" target, {lowest} to {highest} V or with Pa, N/m: {text}_"));
    }
    let Some(note) = &view.note else { return Line::default() };
    Line::styled(format!(" {}", note.text), if note.is_bad { bad() } else { Style::new() })
}

fn key_line(width: u16) -> &'static str {
    match width {
        ..40 => " space STOP  ? help  q quit",
        40..90 => " space STOP  a arm  s set  p play  r record  k acknowledge  ? help  q quit",
        _ => " space STOP  a arm  s set  up/down step  p play  r record  k acknowledge  +/- time  ? help  q quit",
    }
}

#[cfg(test)]
mod tests;
