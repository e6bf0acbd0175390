//! A record compared with a simulation, and their difference in a panel below.

use crate::output::chart::{self, Chart, Series, Shape};
use crate::output::colours::{AFTER, BEFORE, COMMAND, READING};
use crate::output::diagnosis::plots::command;
use identify::record::data::Data;

/// Two panels over the same time as SVG; `simulation` is its stiffness at each row, in V.
pub fn panels(data: &Data, simulation: &[f64]) -> String {
    let each = |value: &dyn Fn(usize) -> f64| (0..data.rows()).map(|row| (data.time_s[row], value(row))).collect();
    let above = vec![
        Series::new("commanded", COMMAND, Shape::Dashed, command(data)),
        Series::new("reading", READING, Shape::Wide, each(&|row| data.reading[row])),
        Series::line("simulation", BEFORE, each(&|row| simulation[row])),
    ];
    let below = Series::line("residual", AFTER, each(&|row| data.reading[row] - simulation[row]));
    let above = Chart { height: 200.0, ..Chart::new("", "", "stiffness [V]", above) };
    let below = Chart { height: 120.0, ..Chart::new("", "time [s]", "residual [V]", vec![below]) };
    chart::stacked(&[&above, &below])
}
