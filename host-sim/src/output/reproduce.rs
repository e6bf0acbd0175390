//! The answer of `vsj reproduce` as text and as a page in Markdown.

use std::fmt::Write;

use paper::reproduce::digits::short;
use paper::reproduce::source::BearsOn;
use paper::reproduce::{self, Item};

/// Disagreements, most important first: by what depends on the number, then by their size.
fn by_importance(report: &reproduce::Report) -> Vec<&Item> {
    let mut wrong: Vec<&Item> = report.items.iter().filter(|item| !item.agrees).collect();
    wrong.sort_by(|one, other| one.bears_on.cmp(&other.bears_on).then(distance(other).total_cmp(&distance(one))));
    wrong
}

/// Size of a disagreement, as the logarithm of the ratio.
fn distance(item: &Item) -> f64 {
    let ratio = item.printed / item.computed;
    if ratio > 0.0 { ratio.ln().abs() } else { f64::INFINITY }
}

fn heading(bears_on: BearsOn) -> &'static str {
    match bears_on {
        BearsOn::Conclusion => "Claims and the numbers they depend on",
        BearsOn::Model => "Inputs and validity of models",
        BearsOn::Result => "Results that nothing else depends on",
        BearsOn::Detail => "Side remarks",
    }
}

/// A computed number with six digits.
fn computed(item: &Item) -> String {
    if item.computed.is_finite() { short(item.computed) } else { "never".to_owned() }
}

/// The disagreements, most important first.
pub fn text(report: &reproduce::Report) -> String {
    let mut text = String::new();
    let mut last = None;
    for item in by_importance(report) {
        if last != Some(item.bears_on) {
            text += &format!("{}\n", heading(item.bears_on));
            last = Some(item.bears_on);
        }
        let note = item.note.as_deref().unwrap_or_default();
        let kind = if item.measured { "expected" } else { "computed" };
        text +=
            &format!("  {}: printed {} {}, {kind} {}\n    {note}.\n", item.place, item.text, item.unit, computed(item));
    }
    text + &summary(report)
}

fn summary(report: &reproduce::Report) -> String {
    let measured = report.items.iter().filter(|item| item.measured).count();
    let wrong = report.items.iter().filter(|item| item.measured && !item.agrees).count();
    format!(
        "{} of {} printed numbers agree; {} do not. {measured} of them were measured and are compared with the \
         prediction of other measured numbers; {wrong} of those are outliers.\n",
        report.agree,
        report.items.len(),
        report.disagree
    )
}

/// A page in Markdown with every number.
pub fn page(report: &reproduce::Report) -> String {
    let mut page = String::new();
    // Writing to a string cannot fail.
    let _ = write_page(&mut page, report);
    page
}

fn write_page(out: &mut String, report: &reproduce::Report) -> std::fmt::Result {
    writeln!(out, "# The printed numbers of the source report, recomputed\n")?;
    writeln!(
        out,
        "The source report: X. Liu, *Modeling of a Piezoelectric Beam Spring*, BSc report 030RAM2016, University of \
         Twente, August 2016.\n"
    )?;
    writeln!(
        out,
        "Written by `cargo run --release -- reproduce --out docs/reproduce`; a test checks that it is up to date.\n"
    )?;
    writeln!(out, "{}", summary(report))?;
    writeln!(
        out,
        "A number agrees if the computed value equals it to the last printed digit. Whether digits were rounded or truncated is \
         decided for each table by the number of agreements; truncated: {}. A claim such as \"more than\" agrees if it holds. A \
         measured number agrees if it lies within the prediction interval of the other measurements (5 % false alarms per \
         table).\n",
        if report.truncated_groups.is_empty() { "none".to_owned() } else { report.truncated_groups.join(", ") }
    )?;
    writeln!(out, "| | numbers | disagree |\n| --- | ---: | ---: |")?;
    for bears_on in [BearsOn::Conclusion, BearsOn::Model, BearsOn::Result, BearsOn::Detail] {
        let of_kind = || report.items.iter().filter(|item| item.bears_on == bears_on);
        let wrong = of_kind().filter(|item| !item.agrees).count();
        writeln!(out, "| {} | {} | {wrong} |", heading(bears_on), of_kind().count())?;
    }
    writeln!(out, "\n## Disagreements, most important first\n")?;
    let mut last = None;
    for (index, item) in by_importance(report).into_iter().enumerate() {
        if last != Some(item.bears_on) {
            let space = if last.is_some() { "\n" } else { "" };
            writeln!(out, "{space}### {}\n", heading(item.bears_on))?;
            last = Some(item.bears_on);
        }
        let kind = if item.measured { "expected" } else { "computed" };
        writeln!(
            out,
            "{}. **{}**: printed {} {}, {kind} {}.  \n   {}.",
            index + 1,
            item.place,
            item.text,
            item.unit,
            computed(item),
            item.note.as_deref().unwrap_or_default()
        )?;
    }
    writeln!(out, "\n## Every number\n")?;
    writeln!(out, "| where | printed | computed | unit | agrees |\n| --- | ---: | ---: | --- | --- |")?;
    for item in &report.items {
        let agrees = if item.agrees { "yes" } else { "**no**" };
        writeln!(out, "| {} | {} | {} | {} | {agrees} |", item.place, item.text, computed(item), item.unit)?;
    }
    Ok(())
}
