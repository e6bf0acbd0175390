//! The report page: one self-contained HTML file.

use identify::Identified;
use maud::{Markup, html};
use simulation::units::Units;

use crate::output::diagnosis::number::number;
use crate::output::files::PLANT_FILE;
use crate::output::identify::Origin;
use crate::output::identify::table::{self, Line};
use crate::output::page::{Figure, Row, Table, document};

/// The whole page; texts from files are escaped.
pub(super) fn page(identified: &Identified, units: &Units, origin: &Origin, figures: &[Figure]) -> String {
    let report = &identified.report;
    let names: Vec<&str> = identified.records.iter().map(|record| record.name.as_str()).collect();
    let title = format!("Identification of {}", names.join(", "));
    let body = html! {
        div.sentences {
            p { (table::sentence(report)) }
            @for remark in &report.remarks { p { (remark) } }
        }
        h2 { "The spring" }
        (lines(["", "value", "95 % interval"], &table::quantities(report, units)))
        h2 { "Readings and model" }
        @for figure in figures { (figure.markup()) }
        h2 { "Linear models" }
        p.small {
            "The best model of each order, in free run on segments that its fit did not use. On the last 40 %, by a fit to the "
            "first 60 %, the nominal model's error is " (number(report.last_40_percent_rmse)) " " (report.unit) "."
        }
        (lines(["order", &format!("held-out RMSE [{}]", report.unit), ""], &table::orders(report)))
        h2 { "Plant file" }
        p.small { (PLANT_FILE) ", for " code { "--plant" } }
        pre { (identified.plant.to_toml().unwrap_or_default()) }
        footer {
            dl {
                dt { "Version" } dd { "vsj " (crate::VERSION) }
                dt { "Command" } dd { code { (origin.command) } }
                dt { "Rows" } dd { (report.rows) }
            }
        }
    };
    document(&title, body)
}

fn lines(head: [&str; 3], lines: &[Line]) -> Markup {
    let mut table = head.iter().fold(Table::default(), |table, name| table.column(name, ""));
    for line in lines {
        table.row(Row::new(line.iter().map(|cell| html! { (cell) })));
    }
    table.markup()
}
