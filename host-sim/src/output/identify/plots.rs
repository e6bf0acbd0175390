//! Plots of an identification as SVG.

use identify::Identified;
use identify::nominal::Course;
use kuva::prelude::*;
use simulation::units::Units;

use crate::output::diagnosis::figures::Figure;
use crate::output::draw::{self, Axes, line, thinned};
use crate::output::style::{AFTER, BEFORE, READING};

/// Two figures for each record: readings with the model, and the held-out residual.
pub(super) fn figures(identified: &Identified, units: &Units) -> Vec<Figure> {
    identified.records.iter().flat_map(|record| of_record(record, units)).collect()
}

fn of_record(record: &Course, units: &Units) -> [Figure; 2] {
    let over_time = |value: &dyn Fn(usize) -> f64| {
        thinned((0..record.reading.len()).map(|row| (record.time_s[row] / units.time.si, value(row))).collect())
    };
    let x = format!("time [{}]", units.time.name);
    let drawn = |plots: Vec<Plot>, title: &str, y: &str| {
        let layout = draw::layout(&plots, Axes { title, x: &x, y: &format!("{y} [{}]", units.reading) });
        let ends = [record.time_s.first(), record.time_s.last()].map(|time| time.unwrap_or(&0.0) / units.time.si);
        render_to_svg(plots, layout.with_x_axis_min(ends[0]).with_x_axis_max(ends[1]))
    };
    let readings: Vec<Plot> = vec![
        line(over_time(&|row| record.reading[row]), READING, "reading").into(),
        line(over_time(&|row| record.reading[row] - record.residual[row]), AFTER, "model").into(),
    ];
    let residuals: Vec<Plot> = vec![
        line(over_time(&|row| record.held_out[row]), BEFORE, "held out").into(),
        line(over_time(&|row| record.residual[row]), AFTER, "fit").into(),
    ];
    [
        Figure {
            name: "readings.svg",
            caption: "Readings compared with the model in free run: its only input is the voltage.",
            svg: drawn(readings, &record.name, "reading"),
        },
        Figure {
            name: "residual.svg",
            caption: "Reading minus model: of the fit to all rows, and of predictions by fits that did not use the segment.",
            svg: drawn(residuals, &record.name, "reading less model"),
        },
    ]
}
