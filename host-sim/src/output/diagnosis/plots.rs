//! Plots of a diagnosis.

use crate::output::chart::{Chart, Series, Shape, thinned};
use crate::output::colours::{AFTER, BEFORE, COMMAND, READING};
use crate::output::diagnosis::extension::is_extended;
use identify::answer;
use identify::dimension::Dimension;
use identify::record::data::Data;
use identify::verdict::diagnosis::Diagnosis;

/// Records with at most this number of rows are drawn as points, since a line would suggest values in between.
const POINTS: usize = 120;
/// Radii of the circles of readings and of the discs of simulations, which fit into them.
const READ: f64 = 4.5;
const SIMULATED: f64 = 3.0;

/// Readings compared with both simulations.
pub(super) fn readings(diagnosis: &Diagnosis) -> Chart {
    let Diagnosis { data, baseline, extended, .. } = diagnosis;
    let mut series = Vec::new();
    if in_volts(data) {
        series.push(Series::new("commanded", COMMAND, Shape::Dashed, command(data)));
    }
    let [read, simulated] =
        if data.rows() > POINTS { [Shape::Wide, Shape::Line] } else { [Shape::Rings(READ), Shape::Discs(SIMULATED)] };
    series.extend([
        by_row(data, |row| data.reading[row], read, READING, "reading"),
        by_row(data, |row| data.reading[row] - baseline.residual[row], simulated, BEFORE, "simulation"),
    ]);
    if is_extended(diagnosis) {
        series.push(by_row(data, |row| data.reading[row] - extended.residual[row], simulated, AFTER, "extended"));
    }
    over_time(data, series, "Readings and simulations", &readings_label(data))
}

/// True if readings have the unit of the voltage, so that both can be drawn in one plot.
fn in_volts(data: &Data) -> bool {
    data.scales().unit(Dimension::Reading) == data.scales().unit(Dimension::Voltage)
}

fn readings_label(data: &Data) -> String {
    let unit = data.scales().unit(Dimension::Reading);
    if in_volts(data) { format!("voltage, reading [{unit}]") } else { format!("reading [{unit}]") }
}

fn difference_label(data: &Data) -> String {
    format!("residual [{}]", data.scales().unit(Dimension::Reading))
}

/// Size of the unit of time that is shown, in s.
fn time_unit(data: &Data) -> f64 {
    data.scales().units.time.si
}

/// Size of the unit of voltage that is shown, in V.
fn voltage_unit(data: &Data) -> f64 {
    data.scales().units.voltage.si
}

/// A value of each row over time.
fn by_row(data: &Data, value: impl Fn(usize) -> f64, shape: Shape, colour: &'static str, name: &str) -> Series {
    let values = (0..data.rows()).map(|row| (data.time_s[row] / time_unit(data), value(row))).collect();
    Series::new(name, colour, shape, values)
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
    corners
}

/// Residuals of both simulations over time.
pub(super) fn residual(diagnosis: &Diagnosis) -> Chart {
    let data = &diagnosis.data;
    let shape = if data.rows() > POINTS { Shape::Line } else { Shape::Discs(SIMULATED) };
    let series = residuals(diagnosis)
        .into_iter()
        .map(|(residual, colour, name)| by_row(data, |row| residual[row], shape, colour, name));
    over_time(data, series.collect(), "Residual over time", &difference_label(data))
}

/// Residuals of both simulations over the commanded voltage.
pub(super) fn residual_by_voltage(diagnosis: &Diagnosis) -> Chart {
    let data = &diagnosis.data;
    let series = residuals(diagnosis).into_iter().map(|(residual, colour, name)| {
        // Thinned along the rows, so that each stretch of the record keeps its extremes.
        let rows = thinned(residual.iter().enumerate().map(|(row, &left)| (row as f64, left)).collect());
        let left = rows.into_iter().map(|(row, left)| (data.voltage_v[row as usize] / voltage_unit(data), left));
        Series::new(name, colour, Shape::Discs(2.5), left.collect())
    });
    let x = format!("commanded voltage [{}]", data.scales().unit(Dimension::Voltage));
    Chart::new("Residual against voltage", &x, &difference_label(data), series.collect())
}

/// Autocorrelation of the whitened residual.
pub(super) fn autocorrelation(report: &answer::Report) -> Chart {
    correlation(report, &report.residual.autocorrelation, 1, "Residual with itself")
}

/// Correlation of the whitened residual with the voltage's changes.
pub(super) fn input_correlation(report: &answer::Report) -> Chart {
    correlation(report, &report.residual.input_correlation, 0, "Residual with the voltage's changes")
}

/// A plot over the time of a record.
fn over_time(data: &Data, series: Vec<Series>, title: &str, y: &str) -> Chart {
    Chart::new(title, &format!("time [{}]", data.scales().unit(Dimension::Time)), y, series)
}

fn correlation(report: &answer::Report, values: &[f64], first_lag: usize, title: &str) -> Chart {
    // Two rows are not farther apart than the record is long.
    let values = &values[..values.len().min(report.rows - first_lag)];
    let stems = values.iter().enumerate().map(|(index, &value)| ((index + first_lag) as f64, value));
    let series = Series::new("correlation", AFTER, Shape::Stems, stems.collect());
    Chart { band: Some(report.residual.band), ..Chart::new(title, "rows later", "correlation", vec![series]) }
}

fn residuals(diagnosis: &Diagnosis) -> Vec<(&[f64], &'static str, &'static str)> {
    let mut residuals = vec![(diagnosis.baseline.residual.as_slice(), BEFORE, "simulation")];
    if is_extended(diagnosis) {
        residuals.push((&diagnosis.extended.residual, AFTER, "extended"));
    }
    residuals
}
