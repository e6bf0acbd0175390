//! Curves and points over common axes, as data; `vsj` draws them.

/// Curves and points over common axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// Heading of the figure.
    pub title: String,
    /// Label of the horizontal axis, with its unit.
    pub x_label: String,
    /// Label of the vertical axis, with its unit.
    pub y_label: String,
    /// Curves and points, in drawing order.
    pub series: Vec<Series>,
}

/// One curve or one set of points, in the units of the axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// How it is drawn.
    pub style: Style,
    /// Horizontal and vertical coordinate of each point.
    pub points: Vec<(f64, f64)>,
}

/// Style of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A solid curve.
    Solid,
    /// A dashed curve, used for comparisons.
    Dashed,
    /// Single points.
    Points,
}

impl Figure {
    /// Creates empty axes.
    pub fn new(title: &str, x_label: &str, y_label: &str) -> Self {
        let [title, x_label, y_label] = [title, x_label, y_label].map(str::to_owned);
        Self { title, x_label, y_label, series: Vec::new() }
    }

    /// Adds a curve, dashed if it is for comparison.
    pub fn curve(self, name: &str, points: impl IntoIterator<Item = (f64, f64)>, dashed: bool) -> Self {
        self.with(name, if dashed { Style::Dashed } else { Style::Solid }, points)
    }

    /// Adds single points.
    pub fn points(self, name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.with(name, Style::Points, points)
    }

    fn with(mut self, name: &str, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.series.push(Series { name: name.to_owned(), style, points: points.into_iter().collect() });
        self
    }
}
