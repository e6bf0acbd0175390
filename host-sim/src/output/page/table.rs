//! Tables of a page. On a narrow screen each row becomes a block, in which each cell is named after its column.

use maud::{Markup, html};

/// A table.
#[derive(Default)]
pub(in crate::output) struct Table {
    columns: Vec<(String, &'static str)>,
    rows: Vec<Row>,
}

/// A row of a table.
pub(in crate::output) struct Row {
    class: &'static str,
    cells: Vec<Markup>,
    note: Option<Markup>,
}

impl Row {
    /// A row with a cell for each column.
    pub(in crate::output) fn new(cells: impl IntoIterator<Item = Markup>) -> Self {
        Self { class: "", cells: cells.into_iter().collect(), note: None }
    }

    /// The row with a class for the style sheet.
    pub(in crate::output) fn class(self, class: &'static str) -> Self {
        Self { class, ..self }
    }

    /// The row with a remark below it, over all columns.
    pub(in crate::output) fn note(self, note: Markup) -> Self {
        Self { note: Some(note), ..self }
    }
}

impl Table {
    /// The table with a further column: its name, which may be empty, and the classes of its cells.
    pub(in crate::output) fn column(mut self, name: &str, class: &'static str) -> Self {
        self.columns.push((name.to_owned(), class));
        self
    }

    /// Adds a row.
    pub(in crate::output) fn row(&mut self, row: Row) {
        self.rows.push(row);
    }

    /// The table as HTML; its roles are stated since a folded table is none for browsers.
    pub(in crate::output) fn markup(&self) -> Markup {
        html! {
            table role="table" {
                thead { tr role="row" {
                    @for (name, class) in &self.columns { th role="columnheader" scope="col" class=[some(class)] { (name) } }
                } }
                tbody {
                    @for Row { class, cells, note } in &self.rows {
                        tr role="row" class=[some(class)] {
                            @for ((name, class), cell) in self.columns.iter().zip(cells) {
                                td role="cell" class=[some(class)] data-name=[some(name)] { @if !cell.0.is_empty() { div { (cell) } } }
                            }
                        }
                        @if let Some(note) = note {
                            tr.note role="row" { td.small role="cell" colspan=(self.columns.len()) { (note) } }
                        }
                    }
                }
            }
        }
    }
}

fn some(text: &str) -> Option<&str> {
    (!text.is_empty()).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_carries_the_name_of_its_column_for_narrow_screens() {
        let mut table = Table::default().column("cause & place", "cause").column("", "").column("RMSE [V]", "number");
        table.row(Row::new([html! { "hum" }, html! { i {} }, html! { "2" }]).class("best").note(html! { "why" }));
        let html = table.markup().into_string();
        for part in [
            r#"<td role="cell" class="cause" data-name="cause &amp; place"><div>hum</div></td>"#,
            r#"<td role="cell"><div><i></i></div></td>"#,
            r#"<td role="cell" class="number" data-name="RMSE [V]"><div>2</div></td>"#,
            r#"<tr role="row" class="best">"#,
            r#"colspan="3">why</td>"#,
        ] {
            assert!(html.contains(part), "{part}: {html}");
        }
    }
}
