//! A figure of curves and points as a plot.

use paper::figure::{Figure, Style};

use crate::output::chart::{COLOURS, Chart, Series, Shape};

/// Draws a figure as SVG.
pub fn svg(figure: &Figure) -> String {
    let mut colours = COLOURS.iter().cycle();
    let series = figure.series.iter().map(|series| {
        let (colour, shape) = match series.style {
            Style::Points => ("#000000", Shape::Discs(3.5)),
            Style::Dashed => (*colours.next().expect("a cycle has no end"), Shape::Dashed),
            _ => (*colours.next().expect("a cycle has no end"), Shape::Line),
        };
        Series::new(&series.name, colour, shape, series.points.clone())
    });
    Chart::new(&figure.title, &figure.x_label, &figure.y_label, series.collect()).file()
}
