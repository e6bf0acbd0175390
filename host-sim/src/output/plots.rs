//! Plots of a run as SVG.

use kuva::prelude::*;

use paper::stair;
use simulation::experiment::{Experiment, Run, Sample};

use crate::output::draw::{self, Axes, line, thinned};

const TARGET: &str = "#888888";
const WITH: &str = "#0072b2";
const WITHOUT: &str = "#d55e00";
const MEASURED: &str = "#000000";

/// Target, stiffness with and without controller, and the measured points.
pub fn stiffness<P>(experiment: &Experiment<P>, run: &Run, report: &stair::Report) -> String {
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

fn render(plots: Vec<Plot>, title: &str, y_label: &str) -> String {
    draw::svg(plots, Axes { title, x: "time [s]", y: y_label })
}
