//! The list of keys over the plots.

use ratatui::Frame;
use ratatui::layout::{Constraint, Flex, Layout};
use ratatui::text::Line;
use ratatui::widgets::{Block, Clear, Paragraph};

use crate::watch::keys::KEYS;
use crate::watch::view::View;

pub(super) fn draw(view: &View, frame: &mut Frame<'_>) {
    let mut lines: Vec<Line> = KEYS.iter().map(|(key, what)| Line::raw(format!(" {key:<14} {what}"))).collect();
    lines.push(Line::default());
    lines.push(Line::raw(format!(" schedule: {}", view.schedule)));
    lines.push(Line::raw(" Stiffness is in V of equivalent static voltage."));
    let width = lines.iter().map(Line::width).max().unwrap_or_default() as u16 + 3;
    let height = lines.len() as u16 + 2;
    let [area] = Layout::vertical([Constraint::Length(height)]).flex(Flex::Center).areas(frame.area());
    let [area] = Layout::horizontal([Constraint::Length(width)]).flex(Flex::Center).areas(area);
    frame.render_widget(Clear, area);
    frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" Keys ")), area);
}
