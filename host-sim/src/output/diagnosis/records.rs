//! What each of several records shows beyond the causes that they share.

use std::fmt::Write;

use identify::answer::{Finding, RecordReport};
use identify::dimension::Dimension;
use identify::record::scales::Scales;
use maud::{Markup, html};

use crate::output::diagnosis::number::{interval, number, shown_name};
use crate::output::diagnosis::tables;
use crate::output::page::{Row, Table};

/// The table for the terminal; empty for a single record.
pub(super) fn text(records: &[RecordReport], scales: &Scales) -> String {
    let mut text = String::new();
    if records.is_empty() {
        return text;
    }
    let width = records.iter().map(|of| of.name.chars().count()).max().unwrap_or(0).max(6);
    let [rows, offset, sigma, rmse] = columns(scales);
    let [offsets, sigmas, rmses] = [&offset, &sigma, &rmse].map(|name| name.chars().count().max(10));
    let _ = writeln!(
        text,
        "\n{:width$} {rows:>7} {offset} {sigma:>sigmas$} {rmse:>rmses$}   in this record only",
        "record"
    );
    for of in records {
        let numbers = [of.offset, of.sigma, of.rmse].map(number);
        let [offset, sigma, rmse] = &numbers;
        let only = only(of, scales).join("; ");
        let _ = writeln!(
            text,
            "{:width$} {:>7} {offset:>offsets$} {sigma:>sigmas$} {rmse:>rmses$}   {only}",
            of.name, of.rows
        );
    }
    text
}

/// Names of the columns of numbers, with the reading's unit.
fn columns(scales: &Scales) -> [String; 4] {
    let unit = scales.unit(Dimension::ReadingSize);
    ["rows".into(), format!("zero offset [{unit}]"), format!("noise [{unit}]"), format!("RMSE [{unit}]")]
}

/// The section of the page; empty for a single record.
pub(super) fn section(records: &[RecordReport], scales: &Scales) -> Markup {
    let columns = columns(scales);
    let table = columns.iter().fold(Table::default().column("record", ""), |table, name| table.column(name, "number"));
    let mut table = table.column("in this record only", "");
    for of in records {
        let numbers = [of.rows.to_string()].into_iter().chain([of.offset, of.sigma, of.rmse].map(number));
        let cells = std::iter::once(of.name.clone()).chain(numbers).map(|text| html! { (text) });
        table.row(Row::new(cells.chain([tables::list(only(of, scales))])));
    }
    html! {
        @if !records.is_empty() {
            h2 { "Each record" }
            p.small {
                "Every record has its own initial state, zero offset and noise. What is in one record only is a fault of that record, \
                not a property of the spring."
            }
            (table.markup())
        }
    }
}

/// The findings of one record, each as `cause (parameters)`, and structure that no cause explains; `none` without any.
fn only(of: &RecordReport, scales: &Scales) -> Vec<String> {
    let parameters = |finding: &Finding| {
        let each = finding.parameters.iter().map(|(name, parameter)| {
            format!("{} = {}", shown_name(name, parameter.dimension, scales), interval(parameter, scales))
        });
        each.collect::<Vec<_>>().join(", ")
    };
    let faults = of.findings.iter().map(|finding| format!("{} ({})", finding.cause, parameters(finding)));
    let all: Vec<String> = faults.chain(of.leftover.iter().map(|left| format!("unexplained: {left}"))).collect();
    if all.is_empty() { vec!["none".to_owned()] } else { all }
}

#[cfg(test)]
mod tests {
    use super::*;
    use identify::Verdict;
    use identify::answer::Parameter;

    #[test]
    fn a_fault_is_listed_with_its_record() {
        let limit = Parameter {
            value: 380.0,
            low: 379.9,
            high: 380.1,
            unit: "V".into(),
            dimension: Dimension::Reading,
            at_bound: false,
            extrapolated_from_v: None,
        };
        let finding = Finding {
            cause: "sensor-saturation",
            probability: 1.0,
            parameters: vec![("limit".to_owned(), limit)],
            rmse_before: 2.0,
            rmse_after: 1.0,
            evidence: String::new(),
            proved: false,
        };
        let of = |name: &str, findings: Vec<Finding>| RecordReport {
            name: name.to_owned(),
            rows: 500,
            offset: -8.0,
            sigma: 0.5,
            rmse: 0.5,
            verdict: Verdict::Explained,
            findings,
            leftover: None,
        };
        let scales = Scales::default();
        let text = text(&[of("a.csv", Vec::new()), of("second.csv", vec![finding])], &scales);
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines[0], "record        rows zero offset [V]  noise [V]   RMSE [V]   in this record only");
        assert_eq!(lines[1], "a.csv          500          -8.000     0.5000     0.5000   none");
        assert!(lines[2].ends_with("   sensor-saturation (limit = 380.00 [379.90, 380.10] V)"), "{text}");
        assert!(section(&[], &scales).into_string().is_empty());
    }
}
