//! Common parts of the plots: thinned lines, axes, size.

use kuva::prelude::*;

/// Number of stretches of a line, each drawn by its lowest and highest point; more cannot be resolved.
const STRETCHES: usize = 500;

/// Title and axis labels of a plot.
pub(super) struct Axes<'a> {
    pub(super) title: &'a str,
    pub(super) x: &'a str,
    pub(super) y: &'a str,
}

/// Keeps the lowest and highest point of each stretch and the last point, so that peaks remain.
pub(super) fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    thinned_to(STRETCHES, points)
}

/// Thins a line like [`thinned`], to another number of stretches.
pub(super) fn thinned_to(stretches: usize, points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let last = points.last().copied();
    let stretches = points.chunks(points.len().div_ceil(stretches).max(1));
    let extremes = stretches.flat_map(|stretch| {
        let height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let mut pair = [stretch.iter().min_by(height), stretch.iter().max_by(height)];
        pair.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        pair.into_iter().flatten().copied()
    });
    let mut kept: Vec<(f64, f64)> = extremes.chain(last).collect();
    kept.dedup();
    kept
}

pub(super) fn line(data: Vec<(f64, f64)>, colour: &str, name: &str) -> LinePlot {
    LinePlot::new().with_data(data).with_color(colour).with_stroke_width(1.5).with_legend(name)
}

/// A layout of the default size.
pub(super) fn layout(plots: &[Plot], Axes { title, x, y }: Axes) -> Layout {
    Layout::auto_from_plots(plots)
        .with_title(title)
        .with_x_label(x)
        .with_y_label(y)
        .with_width(900.0)
        .with_height(480.0)
}

/// Plots in common axes of the default size, as SVG.
pub(super) fn svg(plots: Vec<Plot>, axes: Axes) -> String {
    let layout = layout(&plots, axes);
    render_to_svg(plots, layout)
}
