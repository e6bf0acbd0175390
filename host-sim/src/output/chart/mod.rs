//! Plots as SVG and as tables of their values. Series come in with their names and colours; a file, a part of a page or a table
//! goes out.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`axis`] | range and ticks of an axis |
//! | [`values`] | the values of all series at common positions, for the table and for the hover text |
//! | [`svg`] | the drawing |
//!
//! All plots have the same width and the same margins, so that time axes that stand one above the other align. The legend is below
//! the axes. Text grows where the plot is shown narrow, and colours follow the screen's colour scheme.

mod axis;
mod svg;
mod values;

pub(super) use svg::STYLE;
pub(super) use values::Values;

/// Colours that colour-blind readers can distinguish, in the order in which series without a colour of their own take them.
pub(super) const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// Number of stretches of a line, each drawn by its lowest and highest point; more cannot be resolved.
const STRETCHES: usize = 400;

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// A thin line.
    Line,
    /// A thin dashed line.
    Dashed,
    /// A wide pale line, which stays visible under the thin ones.
    Wide,
    /// Discs of a radius in the plot's units of length.
    Discs(f64),
    /// Circles that are not filled, of a radius in the plot's units of length.
    Rings(f64),
    /// Discs with a line to zero.
    Stems,
}

impl Shape {
    /// True if the values between two points of the series are on the line between them.
    fn is_line(self) -> bool {
        matches!(self, Self::Line | Self::Dashed | Self::Wide)
    }
}

/// A named series of points in the units of the axes.
pub(super) struct Series {
    name: String,
    colour: &'static str,
    shape: Shape,
    points: Vec<(f64, f64)>,
}

impl Series {
    /// A series; lines are thinned to what can be resolved, points that are not finite are left out.
    pub(super) fn new(name: &str, colour: &'static str, shape: Shape, points: Vec<(f64, f64)>) -> Self {
        let finite = points.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite()).map(rounded).collect();
        let points = if shape.is_line() { thinned(finite) } else { finite };
        Self { name: name.to_owned(), colour, shape, points }
    }

    /// A thin line.
    pub(super) fn line(name: &str, colour: &'static str, points: Vec<(f64, f64)>) -> Self {
        Self::new(name, colour, Shape::Line, points)
    }
}

/// A plot: axes with series.
pub(super) struct Chart {
    /// Title above the axes; may be empty.
    pub(super) title: String,
    /// Quantity of the horizontal axis, with its unit; may be empty.
    pub(super) x: String,
    /// Quantity of the vertical axis, with its unit.
    pub(super) y: String,
    /// The series, the first one lowest.
    pub(super) series: Vec<Series>,
    /// Half the height of a shaded band about zero, in the unit of the vertical axis.
    pub(super) band: Option<f64>,
    /// Height of the axes, for a width of 720.
    pub(super) height: f64,
}

impl Chart {
    /// A plot of the default height without a band.
    pub(super) fn new(title: &str, x: &str, y: &str, series: Vec<Series>) -> Self {
        Self { title: title.to_owned(), x: x.to_owned(), y: y.to_owned(), series, band: None, height: 290.0 }
    }

    /// The plot as a file of its own.
    pub(super) fn file(&self) -> String {
        svg::file(&[self])
    }

    /// The plot as a part of a page whose style sheet contains [`STYLE`].
    pub(super) fn inline(&self) -> String {
        svg::inline(&[self])
    }

    /// The values of the series.
    pub(super) fn values(&self) -> Values {
        Values::of(self)
    }
}

/// Plots one above the other, as a file.
pub(super) fn stacked(charts: &[&Chart]) -> String {
    svg::file(charts)
}

/// Rounds to seven digits, which is finer than the drawing and the same on every machine.
fn rounded((x, y): (f64, f64)) -> (f64, f64) {
    let short = |value: f64| format!("{value:.6e}").parse().unwrap_or(value);
    (short(x), short(y))
}

/// Keeps the lowest and highest point of each stretch and the last point, so that peaks remain.
pub(super) fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let last = points.last().copied();
    let stretches = points.chunks(points.len().div_ceil(STRETCHES).max(1));
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
