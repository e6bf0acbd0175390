//! A running plot: the last seconds of one or several quantities.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};

use super::axis;
use crate::watch::history::{Lines, Point};
use crate::watch::view::View;

/// Dots of a braille character side by side.
const DOTS: u16 = 2;

/// A quantity with its colour.
#[derive(Clone, Copy)]
pub(super) struct Quantity {
    name: &'static str,
    color: Color,
    value: fn(&Point) -> Option<f64>,
}

pub(super) const TARGET: Quantity =
    Quantity { name: "target", color: Color::Yellow, value: |point| Some(point.target_v) };
pub(super) const ESTIMATE: Quantity =
    Quantity { name: "estimate", color: Color::LightCyan, value: |point| Some(point.estimate_v) };
pub(super) const MEASURED: Quantity =
    Quantity { name: "measured", color: Color::LightMagenta, value: |point| point.measured_v };
pub(super) const APPLIED: Quantity =
    Quantity { name: "applied", color: Color::LightGreen, value: |point| Some(point.applied_v) };

pub(super) fn draw(view: &View, frame: &mut Frame<'_>, area: Rect, title: &'static str, quantities: &[Quantity]) {
    let window_s = view.window_s();
    let curve = |quantity: &Quantity| view.history.curve(window_s, area.width * DOTS, quantity.value);
    let curves: Vec<(Quantity, Lines)> =
        quantities.iter().map(|quantity| (*quantity, curve(quantity))).filter(|(_, lines)| !lines.is_empty()).collect();
    let values = curves.iter().flat_map(|(_, lines)| lines.iter().flatten().map(|point| point.1));
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let [low, middle, high] = if low <= high { axis::range(low, high) } else { axis::range(0.0, 0.0) };
    let line = |quantity: &Quantity, points| {
        let style = Style::new().fg(quantity.color);
        Dataset::default().marker(Marker::Braille).graph_type(GraphType::Line).style(style).data(points)
    };
    let datasets = curves.iter().flat_map(|(quantity, lines)| lines.iter().map(|points| line(quantity, points)));
    let mut legend = vec![Span::raw(format!(" {title} "))];
    for (quantity, _) in &curves {
        legend.push(Span::styled(format!(" {} ", quantity.name), Style::new().fg(quantity.color)));
    }
    let times = [-window_s, -window_s / 2.0].map(|time_s| format!("{time_s} s"));
    let [from, half] = times;
    let chart = Chart::new(datasets.collect())
        .block(Block::bordered().title(Line::from(legend)))
        .legend_position(None)
        .x_axis(Axis::default().bounds([-window_s, 0.0]).labels([from, half, "now".to_owned()]))
        .y_axis(Axis::default().bounds([low, high]).labels([low, middle, high].map(|volts| format!("{volts:5}"))));
    frame.render_widget(chart, area);
}
