//! A plot on a page, with its caption and the table of its values.

use maud::{Markup, PreEscaped, html};

use super::table::{Row, Table};
use crate::output::chart::Chart;

/// A plot with its caption.
pub(in crate::output) struct Figure {
    /// Name of its file.
    pub(in crate::output) name: &'static str,
    /// Caption on the page.
    pub(in crate::output) caption: &'static str,
    /// The plot.
    pub(in crate::output) chart: Chart,
}

impl Figure {
    /// The figure on a page.
    pub(in crate::output) fn markup(&self) -> Markup {
        let values = self.chart.values();
        let mut table = values.names.iter().fold(Table::default(), |table, name| table.column(name, "number"));
        for row in &values.rows {
            table.row(Row::new(row.iter().map(|value| html! { (value) })));
        }
        html! {
            figure {
                (PreEscaped(self.chart.inline()))
                figcaption { (self.caption) }
                details {
                    summary { "Values: " (self.chart.y) }
                    (table.markup())
                }
            }
        }
    }
}
