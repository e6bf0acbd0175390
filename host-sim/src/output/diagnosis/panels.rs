//! A record compared with a simulation, and their difference in a panel below.

use kuva::prelude::*;

use crate::output::diagnosis::plots::command;
use crate::output::draw::{self, Axes, line, thinned_to};
use crate::output::style::{AFTER, BEFORE, COMMAND, READING};
use identify::record::data::Data;

/// Number of stretches that a line is drawn by, since the panels are small.
const STRETCHES: usize = 200;

/// Two panels over the same time as SVG; `simulation` is its stiffness at each row, in V.
pub fn panels(data: &Data, simulation: &[f64]) -> String {
    let each = |value: &dyn Fn(usize) -> f64| {
        thinned_to(STRETCHES, (0..data.rows()).map(|row| (data.time_s[row], value(row))).collect())
    };
    let above: Vec<Plot> = vec![
        line(command(data), COMMAND, "commanded").with_dashed().into(),
        line(each(&|row| data.reading[row]), READING, "reading").into(),
        line(each(&|row| simulation[row]), BEFORE, "simulation").into(),
    ];
    let below: Vec<Plot> =
        vec![line(each(&|row| data.reading[row] - simulation[row]), AFTER, "reading less simulation").into()];
    let (first, last) = (data.time_s[0], data.time_s[data.rows() - 1]);
    let layout = |plots: &[Plot], x: &str, y: &str| {
        let layout = draw::layout(plots, Axes { title: "", x, y });
        // Both panels have the same width and height.
        let layout = layout.with_force_margins(70.0, 10.0).with_force_margins_y(20.0, 50.0 * f64::from(!x.is_empty()));
        layout.with_x_axis_min(first).with_x_axis_max(last)
    };
    let layouts = vec![layout(&above, "", "stiffness [V]"), layout(&below, "time [s]", "difference [V]")];
    let figure = Figure::new(2, 1)
        .with_plots(vec![above, below])
        .with_layouts(layouts)
        .with_cell_size(680.0, 180.0)
        .with_row_height(1, 230.0)
        .with_shared_x_all()
        .with_spacing(0.0)
        .with_shared_legend();
    SvgBackend::new().render_scene(&figure.render())
}
