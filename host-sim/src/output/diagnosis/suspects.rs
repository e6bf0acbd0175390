//! The suspects of a record that its findings do not explain: causes that come close to a finding, with their sizes.

use std::fmt::Write;

use identify::answer::{Judge, Suspect};
use identify::dimension::Dimension;
use identify::record::scales::Scales;
use maud::{Markup, html};

use crate::output::diagnosis::number::{interval, number, probability, shown_name};
use crate::output::diagnosis::tables;
use crate::output::page::Row;

/// Explanation of the table.
const CAPTION: &str = "Causes that come closest to a finding and are none: the score of each lacks this number of nats. An error that grows \
                       means that the rest of the record does not predict the cause. One that the extended simulation \
                       contains has a probability below 0.5.";

/// The table for the terminal; empty without suspects.
pub(super) fn text(suspects: &[Suspect], scales: &Scales) -> String {
    let mut text = String::new();
    if suspects.is_empty() {
        return text;
    }
    let unit = scales.unit(Dimension::ReadingSize);
    let error = |of: &str| format!("{of} [{unit}]");
    let _ = writeln!(
        text,
        "\n{:34} {:>11} {:>15} {:>12}   parameters with 95 % intervals",
        "suspect, no finding",
        "nats short",
        error("RMSE without"),
        error("with")
    );
    for suspect in suspects {
        let _ = writeln!(
            text,
            "{:34} {:>11.1} {:>15} {:>12}   {}",
            suspect.cause,
            suspect.nats_short,
            number(suspect.rmse_before),
            number(suspect.rmse_after),
            parameters(suspect, scales).join(", ")
        );
        let _ = writeln!(text, "  {}{}", judge(suspect.judge), company(suspect));
    }
    text
}

/// The section of the page; empty without suspects.
pub(super) fn section(suspects: &[Suspect], scales: &Scales) -> Markup {
    let mut table = tables::candidates("nats short", scales);
    for suspect in suspects {
        let cells = [
            html! { (suspect.cause) },
            html! { (format!("{:.1}", suspect.nats_short)) },
            tables::list(parameters(suspect, scales)),
            html! { (number(suspect.rmse_before)) },
            html! { (number(suspect.rmse_after)) },
        ];
        table.row(Row::new(cells).class("noted").note(html! { (judge(suspect.judge)) (company(suspect)) "." }));
    }
    html! {
        @if !suspects.is_empty() {
            h2 { "Suspects" }
            p.small { (CAPTION) }
            (table.markup())
        }
    }
}

/// Each parameter with its interval.
fn parameters(suspect: &Suspect, scales: &Scales) -> Vec<String> {
    let shown = |(name, parameter): &(String, _)| {
        let parameter: &identify::answer::Parameter = parameter;
        format!("{} = {}", shown_name(name, parameter.dimension, scales), interval(parameter, scales))
    };
    suspect.parameters.iter().map(shown).collect()
}

/// How the errors were measured.
fn judge(judge: Judge) -> &'static str {
    match judge {
        Judge::HeldOut => "errors on held-out segments",
        Judge::LeaveOneOut => {
            "errors with one reading left out at a time: the cause acts in a part of the record, which held-out segments cannot judge"
        }
        Judge::Fit => "errors of the fit to all readings",
    }
}

/// The causes beside which a suspect stands, and its probability.
fn company(suspect: &Suspect) -> String {
    let with =
        if suspect.with.is_empty() { String::new() } else { format!(", together with {}", suspect.with.join(" and ")) };
    match suspect.probability {
        Some(value) => format!("{with}; in the extended simulation, with {}", probability(value)),
        None => with,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use identify::answer::Parameter;

    fn suspect(judge: Judge, with: Vec<&'static str>) -> Suspect {
        let offset = Parameter {
            value: -70.6,
            low: -90.0,
            high: -51.2,
            unit: "V".into(),
            dimension: Dimension::ReadingDifference,
            at_bound: false,
            extrapolated_from_v: None,
        };
        let parameters = vec![("offset".to_owned(), offset)];
        Suspect {
            cause: "reading-offset",
            with,
            parameters,
            rmse_before: 42.675,
            rmse_after: 21.5,
            nats_short: 2.26,
            judge,
            probability: None,
        }
    }

    #[test]
    fn suspect_is_shown_with_its_size_errors_distance_and_judge() {
        let suspects = [suspect(Judge::LeaveOneOut, Vec::new()), suspect(Judge::HeldOut, vec!["hum", "drift"])];
        let text = text(&suspects, &Scales::default());
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[2][..8], ["reading-offset", "2.3", "42.67", "21.50", "offset", "=", "-71", "[-90,"], "{text}");
        assert_eq!(lines[3][..7], ["errors", "with", "one", "reading", "left", "out", "at"]);
        assert!(text.ends_with("errors on held-out segments, together with hum and drift\n"), "{text}");
        let page = section(&suspects, &Scales::default()).into_string();
        for shown in ["<div>2.3</div>", "offset = -71 [-90, -51] V", "42.67", "21.50", CAPTION] {
            assert!(page.contains(shown), "{shown}: {page}");
        }
    }

    #[test]
    fn without_suspects_nothing_is_shown() {
        assert_eq!(text(&[], &Scales::default()), "");
        assert_eq!(section(&[], &Scales::default()).into_string(), "");
    }
}
