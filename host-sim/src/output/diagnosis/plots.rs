//! Plots of a diagnosis as SVG.

use kuva::prelude::*;

use super::style::{AFTER, BEFORE, COMMAND, READING};
use crate::diagnose::Diagnosis;
use crate::diagnose::data::Data;
use crate::diagnose::report::ResidualReport;
use crate::output::draw::{self, Axes, line, thinned};

/// Readings of a record with no more rows than this are points, not a line.
const POINTS: usize = 120;

/// Readings beside both simulations.
pub fn readings(diagnosis: &Diagnosis) -> String {
    let Diagnosis { data, baseline, extended, .. } = diagnosis;
    let each = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        (0..data.rows()).map(|row| (data.time_s[row], value(row))).collect()
    };
    let read = each(&|row| data.reading[row]);
    let before = each(&|row| data.reading[row] - baseline.residual[row]);
    let mut plots: Vec<Plot> = vec![line(command(data), COMMAND, "commanded").with_dashed().into()];
    let few = data.rows() <= POINTS;
    if !few {
        plots.push(line(thinned(read.clone()), READING, "reading").into());
    }
    plots.push(line(thinned(before), BEFORE, "simulation").into());
    if is_extended(diagnosis) {
        let after = each(&|row| data.reading[row] - extended.residual[row]);
        plots.push(line(thinned(after), AFTER, "extended").into());
    }
    if few {
        plots.push(points(read, READING, "reading").with_size(3.5).into());
    }
    over_time(data, plots, "Readings and simulations", "voltage, scaled stiffness [V]")
}

/// The commanded voltage, between the rows too; of a plateau, its ends.
pub(super) fn command(data: &Data) -> Vec<(f64, f64)> {
    let mut time = data.time_s[0];
    let mut corners: Vec<(f64, f64)> = Vec::new();
    let mut add = |corner: (f64, f64)| {
        if let [.., before, last] = corners.as_mut_slice()
            && before.1 == corner.1
            && last.1 == corner.1
        {
            *last = corner;
        } else {
            corners.push(corner);
        }
    };
    data.command.clone().pass(|piece| {
        add((time, piece.from));
        time += piece.duration_s;
        add((time, piece.to));
        (piece.from, piece.to)
    });
    thinned(corners)
}

/// What both simulations leave, over time.
pub fn residual(diagnosis: &Diagnosis) -> String {
    let times = &diagnosis.data.time_s;
    let mut plots: Vec<Plot> = Vec::new();
    for (residual, colour, name) in residuals(diagnosis) {
        let left: Vec<(f64, f64)> = times.iter().copied().zip(residual.iter().copied()).collect();
        plots.push(line(thinned(left), colour, name).into());
    }
    over_time(&diagnosis.data, plots, "Residual over time", "reading less simulation [V]")
}

/// What both simulations leave, against the commanded voltage.
pub fn residual_by_voltage(diagnosis: &Diagnosis) -> String {
    let data = &diagnosis.data;
    let mut plots: Vec<Plot> = Vec::new();
    for (residual, colour, name) in residuals(diagnosis) {
        // Thinned along the rows, so that each stretch of the record keeps its extremes.
        let rows = thinned(residual.iter().enumerate().map(|(row, &left)| (row as f64, left)).collect());
        let left = rows.into_iter().map(|(row, left)| (data.voltage_v[row as usize], left)).collect();
        plots.push(points(left, colour, name).with_size(2.5).with_marker_opacity(0.6).into());
    }
    let axes = Axes { title: "Residual against voltage", x: "commanded voltage [V]", y: "reading less simulation [V]" };
    draw::svg(plots, axes)
}

/// Autocorrelation of the whitened residual.
pub fn autocorrelation(residual: &ResidualReport) -> String {
    correlation(&residual.autocorrelation, 1, residual.band, "Residual with itself")
}

/// Correlation of the whitened residual with the voltage's changes.
pub fn input_correlation(residual: &ResidualReport) -> String {
    correlation(&residual.input_correlation, 0, residual.band, "Residual with the voltage's changes")
}

/// Plots over the time of a record and no longer.
fn over_time(data: &Data, plots: Vec<Plot>, title: &str, y: &str) -> String {
    let layout = draw::layout(&plots, Axes { title, x: "time [s]", y });
    let (first, last) = (data.time_s[0], data.time_s[data.rows() - 1]);
    render_to_svg(plots, layout.with_x_axis_min(first).with_x_axis_max(last))
}

fn correlation(values: &[f64], first_lag: usize, band: f64, title: &str) -> String {
    let stems = values.iter().enumerate().map(|(index, &value)| ((index + first_lag) as f64, value));
    let plots: Vec<Plot> = vec![LollipopPlot::new().with_points(stems).with_color(AFTER).with_dot_radius(3.5).into()];
    let reach = values.iter().fold(1.5 * band, |most: f64, value| most.max(1.1 * value.abs())).min(1.0);
    let layout = draw::layout(&plots, Axes { title, x: "rows later", y: "correlation" })
        .with_shaded_region(ShadedRegion::horizontal(-band, band).with_color(COMMAND).with_opacity(0.25))
        .with_x_axis_min(-0.5)
        .with_x_axis_max((values.len() + first_lag) as f64 - 0.5)
        .with_x_tick_step(5.0)
        .with_y_axis_min(-reach)
        .with_y_axis_max(reach)
        .with_width(560.0)
        .with_height(360.0);
    render_to_svg(plots, layout)
}

fn points(data: Vec<(f64, f64)>, colour: &str, name: &str) -> ScatterPlot {
    ScatterPlot::new().with_data(data).with_color(colour).with_legend(name)
}

/// True if the extended simulation differs from the one as it was.
fn is_extended(diagnosis: &Diagnosis) -> bool {
    !diagnosis.extended.model.blocks.is_empty()
}

fn residuals(diagnosis: &Diagnosis) -> Vec<(&[f64], &'static str, &'static str)> {
    let mut residuals = vec![(diagnosis.baseline.residual.as_slice(), BEFORE, "simulation")];
    if is_extended(diagnosis) {
        residuals.push((&diagnosis.extended.residual, AFTER, "extended"));
    }
    residuals
}
