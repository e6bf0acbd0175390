//! An identification as text for the terminal.

use identify::Identified;
use simulation::units::Units;

use crate::output::cells::line;
use crate::output::diagnosis::number::number;
use crate::output::identify::table;

/// The whole answer.
pub fn text(identified: &Identified, units: &Units) -> String {
    let report = &identified.report;
    let mut text = String::new();
    line(&mut text, &table::sentence(report));
    line(&mut text, "");
    let quantities = table::quantities(report, units);
    let width = |column: usize| quantities.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let (first, second) = (width(0), width(1));
    line(&mut text, &format!("{:first$}  {:second$}  95 % interval", "", "value"));
    for [name, value, interval] in &quantities {
        line(&mut text, &format!("{name:first$}  {value:second$}  {interval}"));
    }
    line(&mut text, "");
    line(&mut text, &format!("best linear model of order  held-out RMSE [{}]", report.unit));
    for [order, error, mark] in table::orders(report) {
        line(&mut text, &format!("{order:>26}  {error:<12}  {mark}"));
    }
    let last = number(report.last_40_percent_rmse);
    line(&mut text, &format!("On the last 40 %, by a fit to the first 60 %: {last} {}.", report.unit));
    for remark in &report.remarks {
        line(&mut text, remark);
    }
    if let Some(command) = &report.bound_command {
        line(&mut text, &format!("How fast a controller can be with what is known: {command}"));
    }
    text
}
