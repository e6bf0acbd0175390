//! The report page: one self-contained HTML file.

use maud::{Markup, html};

use crate::output::diagnosis::equation;
use crate::output::diagnosis::extension::is_extended;
use crate::output::diagnosis::origin::Origin;
use crate::output::diagnosis::records;
use crate::output::diagnosis::suspects;
use crate::output::diagnosis::tables;
use crate::output::diagnosis::text;
use crate::output::page::{Figure, document, prose};
use identify::answer::Verdict;
use identify::{Diagnosis, Input};

/// The whole page; texts from files are escaped.
pub(super) fn page(diagnosis: &Diagnosis, origin: &Origin, figures: &[Figure]) -> String {
    let (report, scales) = (&diagnosis.report, diagnosis.data.scales());
    let [readings, residual, residual_voltage, correlations @ ..] = figures else { unreachable!("see `figures`") };
    let body = html! {
        p { span.verdict { (verdict(report.verdict)) } }
        div.sentences {
            p { (text::nominal(&report.nominal, scales)) }
            @for sentence in text::sentences(&origin.record, report, scales) { p { (prose(&sentence)) } }
        }
        h2 { "Causes" }
        (tables::findings(&report.findings, scales))
        (suspects::section(&report.suspects, scales))
        (equation::section(report.equation_details.as_ref(), scales))
        (records::section(&report.records, scales))
        h2 { "Readings and simulations" }
        @for figure in [readings, residual, residual_voltage] { (figure.markup()) }
        h2 { "Residual tests" }
        div.pair { @for figure in correlations { (figure.markup()) } }
        @if let Some(leftover) = &report.leftover { p { (leftover) "." } }
        h2 { "Ranking of the causes and their rivals" }
        (tables::standings(diagnosis))
        @if is_extended(diagnosis) {
            h2 { "Held-out improvement" }
            (tables::quality(diagnosis))
            @for sentence in text::limits_of_curves(report, scales) { p { (sentence) } }
            @if let Some(sentence) = text::in_fixed_point(&report.extended, scales) { p { (sentence) } }
            h2 { "Improvement on each held-out segment" }
            (tables::folds(diagnosis))
        } @else {
            h2 { "Accuracy" }
            (tables::quality(diagnosis))
        }
        h2 { "Next experiment" }
        p {
            @match &report.next_experiment {
                Some(next) => { (prose(&capital(next))) "." }
                None => { "None needed: no decision is open." }
            }
        }
        h2 { "Noise" }
        (tables::noise(diagnosis))
        (footer(diagnosis, origin))
    };
    document(&format!("Diagnosis of {}", origin.record), body)
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Consistent => "consistent: the simulation agrees within the noise",
        Verdict::Explained => "explained: the causes below explain the difference",
        Verdict::Ambiguous => "ambiguous: other causes explain the difference as well",
        Verdict::Unexplained => "unexplained: a part of the difference has no known cause",
        Verdict::Insufficient => "insufficient: the record has too little excitation to decide",
    }
}

fn footer(diagnosis: &Diagnosis, Origin { record, column, input, command }: &Origin) -> Markup {
    let between = match input {
        Input::Hold => "held between rows (hold)",
        Input::Linear => "linear between rows (linear)",
        Input::Stair => "the report's stair with its 0.1 s ramps (stair)",
    };
    html! {
        footer {
            dl {
                dt { "Version" } dd { "vsj " (crate::VERSION) }
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
