//! Plots of a diagnosis as SVG.

use kuva::prelude::*;

use crate::output::diagnosis::extension::is_extended;
use crate::output::draw::{self, Axes, line, thinned};
use crate::output::style::{AFTER, BEFORE, COMMAND, READING};
use identify::answer;
use identify::dimension::Dimension;
use identify::record::data::Data;
use identify::verdict::diagnosis::Diagnosis;

/// Records with at most this number of rows are drawn as points, since a line would suggest values in between.
const POINTS: usize = 120;
/// Radii of the points of readings and of simulations.
const READ: f64 = 4.5;
const SIMULATED: f64 = 3.0;
/// Extension of an axis beyond the outermost points, as a part of its length.
const BEYOND: f64 = 0.015;

/// Readings compared with both simulations.
pub fn readings(diagnosis: &Diagnosis) -> String {
    let Diagnosis { data, baseline, extended, .. } = diagnosis;
    let mut plots: Vec<Plot> = Vec::new();
    if in_volts(data) {
        plots.push(line(command(data), COMMAND, "commanded").with_dashed().into());
    }
    plots.extend([
        by_row(data, |row| data.reading[row], READ, READING, "reading"),
        by_row(data, |row| data.reading[row] - baseline.residual[row], SIMULATED, BEFORE, "simulation"),
    ]);
    if is_extended(diagnosis) {
        plots.push(by_row(data, |row| data.reading[row] - extended.residual[row], SIMULATED, AFTER, "extended"));
    }
    over_time(data, plots, "Readings and simulations", &readings_label(data))
}

/// True if readings have the unit of the voltage, so that both can be drawn in one plot.
fn in_volts(data: &Data) -> bool {
    data.scales().unit(Dimension::Reading) == data.scales().unit(Dimension::Voltage)
}

fn readings_label(data: &Data) -> String {
    let unit = data.scales().unit(Dimension::Reading);
    if in_volts(data) { format!("voltage, scaled stiffness [{unit}]") } else { format!("reading [{unit}]") }
}

fn difference_label(data: &Data) -> String {
    format!("reading less simulation [{}]", data.scales().unit(Dimension::Reading))
}

/// Size of the unit of time that is shown, in s.
fn time_unit(data: &Data) -> f64 {
    data.scales().units.time.si
}

/// Size of the unit of voltage that is shown, in V.
fn voltage_unit(data: &Data) -> f64 {
    data.scales().units.voltage.si
}

/// A value of each row over time, as a line or as points of the given radius.
fn by_row(data: &Data, value: impl Fn(usize) -> f64, radius: f64, colour: &str, name: &str) -> Plot {
    let values = (0..data.rows()).map(|row| (data.time_s[row] / time_unit(data), value(row))).collect();
    if data.rows() > POINTS {
        line(thinned(values), colour, name).into()
    } else {
        points(values, colour, name).with_size(radius).into()
    }
}

/// The commanded voltage, also between the rows; plateaus are reduced to their ends.
pub(super) fn command(data: &Data) -> Vec<(f64, f64)> {
    let [time_unit, voltage_unit] = [time_unit(data), voltage_unit(data)];
    let mut time = data.time_s[0];
    let mut corners: Vec<(f64, f64)> = Vec::new();
    let mut add = |(time, voltage): (f64, f64)| {
        let corner = (time / time_unit, voltage / voltage_unit);
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

/// Residuals of both simulations over time.
pub fn residual(diagnosis: &Diagnosis) -> String {
    let data = &diagnosis.data;
    let of =
        |(residual, colour, name): (&[f64], &str, &str)| by_row(data, |row| residual[row], SIMULATED, colour, name);
    over_time(data, residuals(diagnosis).into_iter().map(of).collect(), "Residual over time", &difference_label(data))
}

/// Residuals of both simulations over the commanded voltage.
pub fn residual_by_voltage(diagnosis: &Diagnosis) -> String {
    let data = &diagnosis.data;
    let mut plots: Vec<Plot> = Vec::new();
    for (residual, colour, name) in residuals(diagnosis) {
        // Thinned along the rows, so that each stretch of the record keeps its extremes.
        let rows = thinned(residual.iter().enumerate().map(|(row, &left)| (row as f64, left)).collect());
        let left =
            rows.into_iter().map(|(row, left)| (data.voltage_v[row as usize] / voltage_unit(data), left)).collect();
        plots.push(points(left, colour, name).with_size(2.5).with_marker_opacity(0.6).into());
    }
    let x = format!("commanded voltage [{}]", data.scales().unit(Dimension::Voltage));
    let axes = Axes { title: "Residual against voltage", x: &x, y: &difference_label(data) };
    let (low, high) = data.voltage_v.iter().fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
    let [low, high] = [low, high].map(|voltage| voltage / voltage_unit(data));
    let layout = beyond(draw::layout(&plots, axes), low, high);
    render_to_svg(plots, layout)
}

/// Autocorrelation of the whitened residual.
pub fn autocorrelation(report: &answer::Report) -> String {
    correlation(report, &report.residual.autocorrelation, 1, "Residual with itself")
}

/// Correlation of the whitened residual with the voltage's changes.
pub fn input_correlation(report: &answer::Report) -> String {
    correlation(report, &report.residual.input_correlation, 0, "Residual with the voltage's changes")
}

/// Plots over the time of a record.
fn over_time(data: &Data, plots: Vec<Plot>, title: &str, y: &str) -> String {
    let x = format!("time [{}]", data.scales().unit(Dimension::Time));
    let layout = draw::layout(&plots, Axes { title, x: &x, y });
    let [first, last] = [0, data.rows() - 1].map(|row| data.time_s[row] / time_unit(data));
    let layout = if data.rows() > POINTS {
        layout.with_x_axis_min(first).with_x_axis_max(last)
    } else {
        beyond(layout, first, last)
    };
    render_to_svg(plots, layout)
}

/// An axis from `low` to `high`, slightly extended so that points at the ends are drawn whole.
fn beyond(layout: Layout, low: f64, high: f64) -> Layout {
    let more = BEYOND * (high - low);
    layout.with_x_axis_min(low - more).with_x_axis_max(high + more)
}

fn correlation(report: &answer::Report, values: &[f64], first_lag: usize, title: &str) -> String {
    // Two rows are not farther apart than the record is long.
    let values = &values[..values.len().min(report.rows - first_lag)];
    let band = report.residual.band;
    let stems = values.iter().enumerate().map(|(index, &value)| ((index + first_lag) as f64, value));
    let plots: Vec<Plot> = vec![LollipopPlot::new().with_points(stems).with_color(AFTER).with_dot_radius(3.5).into()];
    let reach = values.iter().fold(1.5 * band, |most: f64, value| most.max(1.1 * value.abs())).min(1.1);
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

fn residuals(diagnosis: &Diagnosis) -> Vec<(&[f64], &'static str, &'static str)> {
    let mut residuals = vec![(diagnosis.baseline.residual.as_slice(), BEFORE, "simulation")];
    if is_extended(diagnosis) {
        residuals.push((&diagnosis.extended.residual, AFTER, "extended"));
    }
    residuals
}
