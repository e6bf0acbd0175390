//! Plots of a run as SVG.

use paper::stair;
use simulation::experiment::{Experiment, Run, Sample};

use crate::output::chart::{Chart, Series, Shape};
use crate::output::colours::{AFTER, BEFORE, COMMAND, READING};

/// Target, stiffness with and without controller, and the measured points.
pub fn stiffness<P>(experiment: &Experiment<P>, run: &Run, report: &stair::Report) -> String {
    let measured: Vec<(f64, f64)> = report.rows.iter().filter_map(|row| Some((row.time_s, row.measured?))).collect();
    let mut series = vec![
        Series::new("target", COMMAND, Shape::Dashed, target(experiment, run)),
        Series::line("without controller", BEFORE, points(run, &run.without, |s| s.stiffness.to_f64())),
        Series::line("with controller", AFTER, points(run, &run.with, |s| s.stiffness.to_f64())),
    ];
    if !measured.is_empty() {
        series.push(Series::new("measured", READING, Shape::Discs(3.5), measured));
    }
    Chart::new("Stiffness of the spring", "time [s]", "equivalent static voltage [V]", series).file()
}

/// Target and the voltage put across the spring.
pub fn voltage<P>(experiment: &Experiment<P>, run: &Run, samples: &[Sample]) -> String {
    let series = vec![
        Series::new("target", COMMAND, Shape::Dashed, target(experiment, run)),
        Series::line("applied", AFTER, points(run, samples, |s| s.applied.to_f64())),
    ];
    Chart::new("Voltage across the spring", "time [s]", "voltage [V]", series).file()
}

fn target<P>(experiment: &Experiment<P>, run: &Run) -> Vec<(f64, f64)> {
    let mut reader = experiment.schedule.reader();
    (0..run.with.len()).map(|tick| (run.time_s(tick), reader.at(run.time_s(tick)))).collect()
}

fn points(run: &Run, samples: &[Sample], value: impl Fn(&Sample) -> f64) -> Vec<(f64, f64)> {
    samples.iter().enumerate().map(|(tick, sample)| (run.time_s(tick), value(sample))).collect()
}
