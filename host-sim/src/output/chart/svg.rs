//! The drawing of plots as SVG.

use std::fmt::Write;

use super::axis::Axis;
use super::values::span;
use super::{Chart, Series, Shape};

/// Width of every plot; all lengths here are in its units.
const WIDTH: f64 = 720.0;
/// Left margin, wide enough for the largest labels; the same for all plots.
const LEFT: f64 = 88.0;
/// Right margin, which takes half of the last label.
const RIGHT: f64 = 28.0;
/// Distance of two lines of text, for the size of text in a narrow plot.
const LINE: f64 = 30.0;
/// Distance from the axes to the first line of text below them.
const BELOW: f64 = 26.0;
/// Width of a letter in a narrow plot.
const LETTER: f64 = 13.0;
/// Width of a digit in a narrow plot, in a wide typeface.
const DIGIT: f64 = 14.0;
/// Distance from a label to the axis that it is left of.
const GAP: f64 = 8.0;
/// Width of the sample of a line in the legend, with its distances.
const SAMPLE: f64 = 64.0;
/// Largest number of labels on the horizontal and the vertical axis.
const MOST: [usize; 2] = [7, 6];
/// Colours of grid lines, axes and paper.
const GRID: &str = "#cccccc";
const INK: &str = "#000000";
const PAPER: &str = "#ffffff";

/// The style of plots: text that grows in narrow plots, and the colours of a dark screen.
pub(in crate::output) const STYLE: &str = include_str!("plot.css");

/// Plots one above the other as a file with its own style.
pub(super) fn file(charts: &[&Chart]) -> String {
    let height = charts.iter().map(|chart| Panel::new(chart, 0.0).bottom).sum::<f64>();
    let attributes = format!(r#" xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}""#);
    drawing(charts, &attributes, &format!("<style>{STYLE}</style>"))
}

/// Plots one above the other as a part of a page.
pub(super) fn inline(charts: &[&Chart]) -> String {
    drawing(charts, "", "")
}

fn drawing(charts: &[&Chart], attributes: &str, style: &str) -> String {
    let mut body = String::new();
    let mut top = 0.0;
    for chart in charts {
        let panel = Panel::new(chart, top);
        top = panel.bottom;
        // Writing to a string cannot fail.
        let _ = panel.draw(&mut body);
    }
    let titles: Vec<&str> =
        charts.iter().map(|chart| if chart.title.is_empty() { &chart.y } else { &chart.title }.as_str()).collect();
    let label = escaped(&titles.join("; "));
    format!(
        "<svg{attributes} viewBox=\"0 0 {WIDTH} {top}\" class=\"plot\" role=\"img\" aria-label=\"{label}\" fill=\"{INK}\" \
         font-family=\"system-ui, DejaVu Sans, Verdana, Arial, sans-serif\" font-size=\"15\">{style}\n\
         <rect width=\"{WIDTH}\" height=\"{top}\" fill=\"{PAPER}\"/>\n{body}</svg>\n"
    )
}

/// A plot with the place of its parts.
struct Panel<'a> {
    chart: &'a Chart,
    axes: [Axis; 2],
    /// Upper and lower end of the axes.
    span: [f64; 2],
    /// Baseline of the title.
    title: f64,
    /// Place of each series in the legend.
    legend: Vec<(f64, f64)>,
    /// Lower end of the plot.
    bottom: f64,
}

impl<'a> Panel<'a> {
    fn new(chart: &'a Chart, top: f64) -> Self {
        let points = || chart.series.iter().flat_map(|series| series.points.iter().copied());
        let lines = chart.series.iter().all(|series| series.shape.is_line());
        let x = if lines { Axis::exact } else { Axis::beyond }(
            &mut points().map(|point| point.0) as &mut dyn Iterator<Item = f64>
        );
        let band = chart.band.into_iter().flat_map(|band| [-1.5 * band, 1.5 * band]);
        let from_zero = chart.series.iter().any(|series| series.shape == Shape::Stems).then_some(0.0);
        let y = Axis::beyond(points().map(|point| point.1).chain(band).chain(from_zero));

        let title = top + if chart.title.is_empty() { 0.0 } else { LINE };
        let first = title + LINE + 12.0;
        let last = first + chart.height;
        let mut at = (8.0, last + BELOW + if chart.x.is_empty() { 0.0 } else { LINE });
        let mut legend = Vec::new();
        if chart.series.len() > 1 {
            at.1 += LINE;
            for series in &chart.series {
                let width = SAMPLE + LETTER * series.name.chars().count() as f64;
                if at.0 > 8.0 && at.0 + width > WIDTH {
                    at = (8.0, at.1 + LINE);
                }
                legend.push(at);
                at.0 += width;
            }
        }
        Self { chart, axes: [x, y], span: [first, last], title, legend, bottom: at.1 + 0.5 * LINE }
    }

    fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let [top, bottom] = self.span;
        (LEFT + (WIDTH - LEFT - RIGHT) * self.axes[0].part(x), bottom - (bottom - top) * self.axes[1].part(y))
    }

    fn draw(&self, out: &mut String) -> std::fmt::Result {
        let (chart, [top, bottom], right) = (self.chart, self.span, WIDTH - RIGHT);
        if !chart.title.is_empty() {
            text(out, (0.5 * WIDTH, self.title), "middle", " font-weight=\"600\"", &chart.title)?;
        }
        let across = self.axes[0].ticks_apart(MOST[0], right - LEFT, |label| width_of(label) + beyond(label) + GAP);
        let upwards = self.axes[1].ticks_apart(MOST[1], bottom - top, |_| 0.75 * LINE);
        text(out, (8.0, top - 12.0), "start", "", &upwards.quantity(&chart.y))?;
        if let Some(band) = chart.band {
            let [high, low] = [band, -band].map(|y| self.at((0.0, y)).1);
            let (width, height) = (right - LEFT, low - high);
            writeln!(
                out,
                r##"<rect x="{LEFT}" y="{high:.1}" width="{width}" height="{height:.1}" fill="#888888" fill-opacity="0.25"/>"##
            )?;
        }
        write!(out, r#"<path d=""#)?;
        for x in across.values.iter().map(|&tick| self.at((tick, 0.0)).0) {
            write!(out, "M{x:.1} {top}V{bottom}")?;
        }
        for y in upwards.values.iter().map(|&tick| self.at((0.0, tick)).1) {
            write!(out, "M{LEFT} {y:.1}H{right}")?;
        }
        writeln!(out, r#"" stroke="{GRID}"/>"#)?;
        writeln!(out, r#"<path d="M{LEFT} {top}V{bottom}H{right}" stroke="{INK}" fill="none"/>"#)?;
        for (&tick, label) in across.values.iter().zip(across.labels()) {
            let x = self.at((tick, 0.0)).0.min(WIDTH - 0.5 * width_of(&label));
            text(out, (x, bottom + BELOW), "middle", "", &label)?;
        }
        for (&tick, label) in upwards.values.iter().zip(upwards.labels()) {
            let right = (LEFT - GAP).max(width_of(&label)).min(LEFT - 1.0);
            text(out, (right, self.at((0.0, tick)).1 + 6.0), "end", "", &label)?;
        }
        text(out, (0.5 * (LEFT + right), bottom + BELOW + LINE), "middle", "", &across.quantity(&chart.x))?;
        chart.series.iter().try_for_each(|series| self.series(out, series))?;
        for (series, &(x, y)) in chart.series.iter().zip(&self.legend) {
            sample(out, series, (x, y - 6.0))?;
            text(out, (x + 38.0, y), "start", "", &series.name)?;
        }
        self.hover(out)
    }

    fn series(&self, out: &mut String, series: &Series) -> std::fmt::Result {
        if series.shape.is_line() {
            write!(out, "<path d=\"")?;
            for (index, &point) in series.points.iter().enumerate() {
                let (x, y) = self.at(point);
                write!(out, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' })?;
            }
            return writeln!(out, "\"{}/>", stroke(series));
        }
        for &point in &series.points {
            let at = self.at(point);
            if series.shape == Shape::Stems {
                let zero = self.at((0.0, 0.0)).1;
                writeln!(
                    out,
                    r#"<line x1="{0:.1}" y1="{zero:.1}" x2="{0:.1}" y2="{1:.1}" stroke="{2}"/>"#,
                    at.0, at.1, series.colour
                )?;
            }
            disc(out, series, at)?;
        }
        Ok(())
    }

    /// Transparent strips over the axes, each with the values at its position as the text that browsers show on hover.
    fn hover(&self, out: &mut String) -> std::fmt::Result {
        let [top, bottom] = self.span;
        let values = self.chart.values();
        writeln!(out, r##"<g class="hover" fill="#888888" fill-opacity="0">"##)?;
        for (index, row) in values.rows.iter().enumerate() {
            let edge = |x: f64| self.at((x, 0.0)).0.clamp(LEFT, WIDTH - RIGHT);
            let [left, right] = span(&values.positions, index).map(edge);
            write!(
                out,
                r#"<rect x="{left:.1}" y="{top}" width="{:.1}" height="{}"><title>"#,
                right - left,
                bottom - top
            )?;
            let lines: Vec<String> =
                values.names.iter().zip(row).map(|(name, value)| escaped(&format!("{name}: {value}"))).collect();
            writeln!(out, "{}</title></rect>", lines.join("\n"))?;
        }
        writeln!(out, "</g>")
    }
}

/// The attributes of a line.
fn stroke(series: &Series) -> String {
    let more = match series.shape {
        Shape::Wide => r#" stroke-width="5" stroke-opacity="0.35""#,
        Shape::Dashed => r#" stroke-width="1.6" stroke-dasharray="8 4""#,
        _ => r#" stroke-width="1.6""#,
    };
    format!(r#" fill="none" stroke-linejoin="round" stroke="{}"{more}"#, series.colour)
}

fn disc(out: &mut String, series: &Series, (x, y): (f64, f64)) -> std::fmt::Result {
    let colour = series.colour;
    match series.shape {
        Shape::Rings(radius) => {
            writeln!(
                out,
                r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="none" stroke="{colour}" stroke-width="1.6"/>"#
            )
        }
        Shape::Discs(radius) => {
            writeln!(out, r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="{colour}" fill-opacity="0.7"/>"#)
        }
        _ => writeln!(out, r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.5" fill="{colour}"/>"#),
    }
}

/// A series' entry in the legend, without its name.
fn sample(out: &mut String, series: &Series, (x, y): (f64, f64)) -> std::fmt::Result {
    if series.shape.is_line() {
        return writeln!(out, r#"<line x1="{x}" y1="{y}" x2="{}" y2="{y}"{}/>"#, x + 30.0, stroke(series));
    }
    disc(out, series, (x + 15.0, y))
}

/// Length by which the label of a tick at the right end would exceed a narrow plot.
fn beyond(label: &str) -> f64 {
    (0.5 * width_of(label) - RIGHT).max(0.0)
}

/// Width of the label of a tick in a narrow plot.
fn width_of(label: &str) -> f64 {
    label.chars().map(|letter| if ['.', '-'].contains(&letter) { 0.55 * DIGIT } else { DIGIT }).sum()
}

fn text(out: &mut String, (x, y): (f64, f64), anchor: &str, more: &str, text: &str) -> std::fmt::Result {
    if text.is_empty() {
        return Ok(());
    }
    writeln!(out, r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}"{more}>{}</text>"#, escaped(text))
}

/// Text for the inside of elements and attributes; control characters, which XML has no place for, are left out.
fn escaped(text: &str) -> String {
    let text: String = text.chars().filter(|letter| *letter == '\n' || !letter.is_control()).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prop_assert;
    use proptest::test_runner::{Config, TestRunner};

    fn chart(names: &[&str], size: f64) -> Chart {
        let series = names.iter().map(|name| Series::line(name, "#0072b2", vec![(0.0, -size), (10.0, size)]));
        Chart::new("<title> & more", "time [s]", "voltage [V]", series.collect())
    }

    fn axes(svg: &str) -> Vec<&str> {
        svg.lines().filter(|line| line.contains("\" stroke=\"#000000\" fill=\"none\"")).collect()
    }

    #[test]
    fn time_axes_align_whatever_legend_and_labels_are() {
        let [narrow, wide] = [chart(&["a"], 1.0), chart(&["a", "a very long name of a series", "another name"], 1e5)];
        let ends = |chart: &Chart| {
            let svg = file(&[chart]);
            let axis = axes(&svg)[0].to_owned();
            [
                axis[axis.find('M').unwrap()..].split(' ').next().unwrap().to_owned(),
                axis[axis.find('H').unwrap()..].to_owned(),
            ]
        };
        assert_eq!(ends(&narrow), ends(&wide));
        assert_eq!(axes(&file(&[&narrow, &wide])).len(), 2);
    }

    #[test]
    fn legend_is_below_the_axes_and_within_the_plot() {
        let names = ["reading", "simulation with a long name", "another long name", "extended"];
        let chart = chart(&names, 1.0);
        let panel = Panel::new(&chart, 0.0);
        for (name, (x, y)) in names.iter().zip(&panel.legend) {
            assert!(*y > panel.span[1] + BELOW && *y < panel.bottom, "{name}: {y}");
            assert!(x + SAMPLE + LETTER * name.len() as f64 <= WIDTH, "{name}: {x}");
        }
    }

    /// Left, right, upper and lower end of the labels of both axes in a narrow plot.
    fn boxes(svg: &str) -> Vec<[f64; 4]> {
        let value = |line: &str, name: &str| -> Option<f64> {
            line.split_once(&format!(" {name}=\""))?.1.split('"').next()?.parse().ok()
        };
        let of = |line: &str| {
            let label = line.split_once('>')?.1.split('<').next()?;
            label.parse::<f64>().ok()?;
            let (x, y, width) = (value(line, "x")?, value(line, "y")?, width_of(label));
            let left = x - if line.contains("\"middle\"") { 0.5 * width } else { width };
            Some([left, left + width, y - 16.0, y])
        };
        svg.lines().filter(|line| line.starts_with("<text")).filter_map(of).collect()
    }

    #[test]
    fn labels_of_the_axes_neither_touch_nor_leave_a_narrow_plot() {
        let mut random = TestRunner::new(Config { failure_persistence: None, ..Config::with_cases(2000) });
        let ends = (-1e5..1e5f64, -6..5i32, 0.0..1.0f64);
        let both = ((ends.clone(), ends), 100.0..300.0f64);
        random
            .run(&both, |((x, y), height)| {
                let from =
                    |(low, power, length): (f64, i32, f64), part: f64| low + part * (0.01 + length) * 10f64.powi(power);
                let points =
                    (0..9).map(|part| f64::from(part) / 8.0).map(|part| (from(x, part), from(y, part))).collect();
                let series = vec![Series::line("a", "#0072b2", points)];
                let boxes = boxes(&file(&[&Chart { height, ..Chart::new("", "t", "y", series) }]));
                prop_assert!(boxes.len() >= 4, "{boxes:?}");
                for (index, [left, right, top, bottom]) in boxes.iter().enumerate() {
                    prop_assert!(*left >= -5.0 && *right <= WIDTH, "{left} to {right}");
                    for [other_left, other_right, other_top, other_bottom] in &boxes[..index] {
                        let apart =
                            right <= other_left || other_right <= left || bottom <= other_top || other_bottom <= top;
                        prop_assert!(apart, "{boxes:?}");
                    }
                }
                Ok(())
            })
            .unwrap();
    }

    #[test]
    fn values_are_shown_on_hover_and_texts_are_escaped() {
        let svg = file(&[&chart(&["a & b"], 1.0)]);
        assert!(svg.contains("<title>time [s]: 10.00\na &amp; b: 1.000</title>"), "{svg}");
        assert!(svg.contains("aria-label=\"&lt;title&gt; &amp; more\"") && !svg.contains("a & b"));
        // The page contains the style once, for all of its plots.
        assert!(svg.contains("<style>") && !inline(&[&chart(&["a"], 1.0)]).contains("<style>"));
    }
}
