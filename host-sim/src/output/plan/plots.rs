//! Plots of a plan as SVG.

use identify::plan::Plan;
use simulation::units::Unit;

use crate::output::chart::{COLOURS, Chart, Series};
use crate::output::colours::COMMAND;

/// The schedule, the readings that each set of causes predicts, and their differences from those of the likeliest set.
pub(super) fn figures(plan: &Plan) -> Vec<(&'static str, String)> {
    let mut figures = vec![("schedule.svg", schedule(plan))];
    if let Some(first) = plan.responses.first() {
        let y = format!("reading [{}]", plan.reading_unit);
        figures.push(("responses.svg", responses(plan, "Predicted readings", &y, |_| 0.0)));
        if plan.responses.len() > 1 {
            let title = "Predicted readings less those of the likeliest set";
            figures.push(("differences.svg", responses(plan, title, &y, |row| first.reading[row])));
        }
    }
    figures
}

/// The commanded voltage over time, with its steps.
fn schedule(plan: &Plan) -> String {
    let Unit { name, si } = &plan.command_unit;
    let points = plan
        .commands
        .windows(2)
        .flat_map(|pair| [(pair[0].time_s, pair[0].voltage_v / si), (pair[1].time_s, pair[0].voltage_v / si)]);
    let end = plan.commands.last().map(|last| (last.time_s, last.voltage_v / si));
    let series = Series::line("commanded", COMMAND, points.chain(end).collect());
    Chart::new("Schedule", "time [s]", &format!("voltage [{name}]"), vec![series]).file()
}

fn responses(plan: &Plan, title: &str, y: &str, less: impl Fn(usize) -> f64) -> String {
    let of_set = plan.responses.iter().zip(COLOURS.iter().cycle()).map(|(response, colour)| {
        let readings = response.reading.iter().enumerate().map(|(row, reading)| reading - less(row));
        let points = response.time_s.iter().copied().zip(readings).collect();
        let name = if response.causes.is_empty() { "no cause".to_owned() } else { response.causes.join(" + ") };
        Series::line(&name, colour, points)
    });
    Chart::new(title, "time [s]", y, of_set.collect()).file()
}
