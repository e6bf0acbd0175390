//! Plots of a run as SVG.

use kuva::prelude::*;

use crate::experiment::{Experiment, Run, Sample};
use crate::stair::Report;

/// Stretches of time that a line is drawn by, each with its lowest and highest point; more cannot be seen.
const STRETCHES: usize = 500;

const TARGET: &str = "#888888";
const WITH: &str = "#0072b2";
const WITHOUT: &str = "#d55e00";
const MEASURED: &str = "#000000";

/// Target, stiffness with and without controller, and the measured points.
pub fn stiffness<P>(experiment: &Experiment<P>, run: &Run, report: &Report) -> String {
    let measured: Vec<(f64, f64)> = report.rows.iter().filter_map(|row| Some((row.time_s, row.measured?))).collect();
    let mut plots: Vec<Plot> = vec![
        line(target(experiment, run), TARGET, "target").with_dashed().into(),
        line(points(run, &run.without, |s| s.stiffness.to_f64()), WITHOUT, "without controller").into(),
        line(points(run, &run.with, |s| s.stiffness.to_f64()), WITH, "with controller").into(),
    ];
    if !measured.is_empty() {
        plots.push(
            ScatterPlot::new().with_data(measured).with_color(MEASURED).with_size(3.5).with_legend("measured").into(),
        );
    }
    render(plots, "Stiffness of the spring", "scaled stiffness [V]")
}

/// Target and the voltage put across the spring.
pub fn voltage<P>(experiment: &Experiment<P>, run: &Run, samples: &[Sample]) -> String {
    let plots: Vec<Plot> = vec![
        line(target(experiment, run), TARGET, "target").with_dashed().into(),
        line(points(run, samples, |s| s.applied.to_f64()), WITH, "applied").into(),
    ];
    render(plots, "Voltage across the spring", "voltage [V]")
}

fn target<P>(experiment: &Experiment<P>, run: &Run) -> Vec<(f64, f64)> {
    let mut reader = experiment.schedule.reader();
    thinned((0..run.with.len()).map(|tick| (run.time_s(tick), reader.at(run.time_s(tick)))).collect())
}

fn points(run: &Run, samples: &[Sample], value: impl Fn(&Sample) -> f64) -> Vec<(f64, f64)> {
    thinned(samples.iter().enumerate().map(|(tick, sample)| (run.time_s(tick), value(sample))).collect())
}

/// The lowest and the highest point of each stretch, and the last of all: peaks stay.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let last = points.last().copied();
    let stretches = points.chunks(points.len().div_ceil(STRETCHES));
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

fn line(data: Vec<(f64, f64)>, colour: &str, name: &str) -> LinePlot {
    LinePlot::new().with_data(data).with_color(colour).with_stroke_width(1.5).with_legend(name)
}

fn render(plots: Vec<Plot>, title: &str, y_label: &str) -> String {
    let layout = Layout::auto_from_plots(&plots)
        .with_title(title)
        .with_x_label("time [s]")
        .with_y_label(y_label)
        .with_width(900.0)
        .with_height(480.0);
    render_to_svg(plots, layout)
}
