//! A figure of curves and points as SVG.

use kuva::prelude::*;

/// Colours that stay apart for colour-blind readers, in the order in which curves take them.
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#888888"];

/// Curves and points over common axes.
pub struct Figure {
    title: String,
    x_label: String,
    y_label: String,
    plots: Vec<Plot>,
    curves: usize,
}

impl Figure {
    /// Empty axes.
    pub fn new(title: &str, x_label: &str, y_label: &str) -> Self {
        let [title, x_label, y_label] = [title, x_label, y_label].map(str::to_owned);
        Self { title, x_label, y_label, plots: Vec::new(), curves: 0 }
    }

    /// Adds a curve; `dashed` for what it is compared with.
    pub fn curve(mut self, name: &str, points: impl IntoIterator<Item = (f64, f64)>, dashed: bool) -> Self {
        let curve = LinePlot::new()
            .with_data(points.into_iter().map(rounded).collect::<Vec<_>>())
            .with_color(COLOURS[self.curves % COLOURS.len()])
            .with_stroke_width(1.5)
            .with_legend(name);
        self.plots.push(if dashed { curve.with_dashed().into() } else { curve.into() });
        self.curves += 1;
        self
    }

    /// Adds points.
    pub fn points(mut self, name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let points = ScatterPlot::new()
            .with_data(points.into_iter().map(rounded).collect::<Vec<_>>())
            .with_color("#000000")
            .with_size(3.5)
            .with_legend(name);
        self.plots.push(points.into());
        self
    }

    /// Draws it.
    pub fn svg(self) -> String {
        let layout = Layout::auto_from_plots(&self.plots)
            .with_title(self.title.as_str())
            .with_x_label(self.x_label.as_str())
            .with_y_label(self.y_label.as_str())
            .with_width(900.0)
            .with_height(480.0);
        render_to_svg(self.plots, layout)
    }
}

/// Seven digits are more than can be seen, and the same on every machine.
fn rounded((x, y): (f64, f64)) -> (f64, f64) {
    let short = |value: f64| format!("{value:.6e}").parse().unwrap_or(value);
    (short(x), short(y))
}
