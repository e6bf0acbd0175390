//! The frame of a report page: one self-contained HTML file with its style sheet.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::output::chart;

/// A whole page with its title as the first heading; texts in the title are escaped.
pub(in crate::output) fn document(title: &str, body: Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(include_str!("page.css"))) (PreEscaped(chart::STYLE)) }
            }
            body {
                h1 { (title) }
                (body)
            }
        }
    };
    page.into_string()
}
