//! Plots of an identification.

use identify::Identified;
use identify::nominal::Course;
use simulation::units::Units;

use crate::output::chart::{Chart, Series, Shape};
use crate::output::colours::{AFTER, BEFORE, READING};
use crate::output::page::Figure;

/// Two figures for each record: readings with the model, and the held-out residual.
pub(super) fn figures(identified: &Identified, units: &Units) -> Vec<Figure> {
    identified.records.iter().flat_map(|record| of_record(record, units)).collect()
}

fn of_record(record: &Course, units: &Units) -> [Figure; 2] {
    let over_time = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        (0..record.reading.len()).map(|row| (record.time_s[row] / units.time.si, value(row))).collect()
    };
    let chart = |series: Vec<Series>, title: &str, y: &str| {
        Chart::new(title, &format!("time [{}]", units.time.name), &format!("{y} [{}]", units.reading), series)
    };
    let readings = vec![
        Series::new("reading", READING, Shape::Wide, over_time(&|row| record.reading[row])),
        Series::line("model", AFTER, over_time(&|row| record.reading[row] - record.residual[row])),
    ];
    let residuals = vec![
        Series::line("held out", BEFORE, over_time(&|row| record.held_out[row])),
        Series::line("fit", AFTER, over_time(&|row| record.residual[row])),
    ];
    [
        Figure {
            name: "readings.svg",
            caption: "Readings compared with the model in free run: its only input is the voltage.",
            chart: chart(readings, &record.name, "reading"),
        },
        Figure {
            name: "residual.svg",
            caption: "Residual (reading minus model): of the fit to all rows, and of predictions by fits that did not use the segment.",
            chart: chart(residuals, &record.name, "residual"),
        },
    ]
}
