//! The page that a person reads: one HTML file that needs nothing else.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::output::diagnosis::style;
use crate::output::diagnosis::tables;
use crate::output::diagnosis::text;
use crate::output::diagnosis::{Figure, Origin, is_extended};
use identify::answer::Verdict;
use identify::{Diagnosis, Input};

/// The whole page. What comes from files is escaped.
pub(super) fn page(diagnosis: &Diagnosis, origin: &Origin, figures: &[Figure]) -> String {
    let report = &diagnosis.report;
    let [readings, residual, residual_voltage, correlations @ ..] = figures else { unreachable!("see `figures`") };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "Diagnosis of " (origin.record) }
                style { (PreEscaped(style::sheet())) }
            }
            body {
                h1 { "Diagnosis of " (origin.record) }
                p { span.verdict { (verdict(report.verdict)) } }
                div.sentences {
                    @for sentence in text::sentences(&origin.record, report) { p { (sentence) } }
                }
                h2 { "What is wrong" }
                (tables::findings(&report.findings))
                h2 { "Readings and simulations" }
                @for figure in [readings, residual, residual_voltage] { (drawn(figure)) }
                h2 { "Is anything left?" }
                div.pair { @for figure in correlations { (drawn(figure)) } }
                @if let Some(leftover) = &report.leftover { p { (leftover) "." } }
                h2 { "Evidence for the causes and their rivals" }
                (tables::standings(diagnosis))
                @if is_extended(diagnosis) {
                    h2 { "What the cure is worth" }
                    (tables::quality(diagnosis))
                    @if let Some(sentence) = text::in_fixed_point(&report.extended) { p { (sentence) } }
                    h2 { "Gain on stretches that no fit has seen" }
                    (tables::folds(diagnosis))
                } @else {
                    h2 { "How well it fits" }
                    (tables::quality(diagnosis))
                }
                h2 { "Next experiment" }
                p {
                    @match &report.next_experiment {
                        Some(next) => { (capital(next)) "." }
                        None => { "None needed: nothing is left to decide." }
                    }
                }
                h2 { "Noise" }
                (tables::noise(diagnosis))
                (footer(diagnosis, origin))
            }
        }
    };
    page.into_string()
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Consistent => "consistent: nothing is wrong beyond noise",
        Verdict::Explained => "explained: the causes below explain what is wrong",
        Verdict::Ambiguous => "ambiguous: rival causes explain it as well",
        Verdict::Unexplained => "unexplained: something is left that no known cause explains",
        Verdict::Insufficient => "insufficient: the record cannot tell",
    }
}

/// An SVG within a page: it fits the column, and needs no namespace there.
fn drawn(Figure { caption, svg, .. }: &Figure) -> Markup {
    let inline = svg.replacen(r#" xmlns="http://www.w3.org/2000/svg""#, "", 1);
    let side = |name: &str| {
        inline.split_once(&format!(" {name}=\"")).and_then(|(_, rest)| rest.split_once('"')).map(|it| it.0)
    };
    let inline = match (side("width"), side("height")) {
        (Some(width), Some(height)) => {
            inline.replacen("<svg", &format!(r#"<svg role="img" viewBox="0 0 {width} {height}""#), 1)
        }
        _ => inline,
    };
    html! {
        figure {
            (PreEscaped(inline))
            figcaption { (caption) }
        }
    }
}

fn footer(diagnosis: &Diagnosis, Origin { record, column, input, command }: &Origin) -> Markup {
    let between = match input {
        Input::Hold => "held between rows (hold)",
        Input::Linear => "straight from row to row (linear)",
        Input::Stair => "the report's stair with its 0.1 s ramps (stair)",
    };
    html! {
        footer {
            dl {
                dt { "Version" } dd { "vsj " (env!("CARGO_PKG_VERSION")) }
                dt { "Command" } dd { code { (command) } }
                dt { "Data" } dd { (record) ", column " (column) }
                dt { "Rows" } dd { (diagnosis.report.rows) }
                dt { "Voltage" } dd { (between) }
            }
        }
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
