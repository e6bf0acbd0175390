//! A figure of curves and points as SVG.

use kuva::prelude::*;
use paper::figure::{Figure, Style};

/// Colours that colour-blind readers can distinguish, in the order in which curves take them.
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#888888"];

/// Draws a figure as SVG.
pub fn svg(figure: &Figure) -> String {
    let mut colours = COLOURS.iter().cycle();
    let mut plots: Vec<Plot> = Vec::new();
    for series in &figure.series {
        let points: Vec<(f64, f64)> = series.points.iter().copied().map(rounded).collect();
        if series.style == Style::Points {
            let scatter = ScatterPlot::new().with_data(points).with_color("#000000").with_size(3.5);
            plots.push(scatter.with_legend(series.name.as_str()).into());
            continue;
        }
        let curve = LinePlot::new()
            .with_data(points)
            .with_color(*colours.next().expect("a cycle has no end"))
            .with_stroke_width(1.5)
            .with_legend(series.name.as_str());
        plots.push(if series.style == Style::Dashed { curve.with_dashed().into() } else { curve.into() });
    }
    let layout = Layout::auto_from_plots(&plots)
        .with_title(figure.title.as_str())
        .with_x_label(figure.x_label.as_str())
        .with_y_label(figure.y_label.as_str())
        .with_width(900.0)
        .with_height(480.0);
    render_to_svg(plots, layout)
}

/// Rounds to seven digits, which is finer than the drawing and the same on every machine.
fn rounded((x, y): (f64, f64)) -> (f64, f64) {
    let short = |value: f64| format!("{value:.6e}").parse().unwrap_or(value);
    (short(x), short(y))
}
