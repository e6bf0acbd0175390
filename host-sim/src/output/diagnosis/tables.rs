//! The tables of the report page.

use maud::{Markup, html};

use crate::output::diagnosis::extension::is_extended;
use crate::output::diagnosis::number::{interval, linear_name, number, shown_name};
use crate::output::page::{Row, Table};
use identify::answer::{Finding, LinearError};
use identify::dimension::Dimension;
use identify::record::scales::Scales;
use identify::stats::scale::root_mean_square;
use identify::verdict::diagnosis::Diagnosis;
use identify::verdict::ranking::RankedCauses as Standing;

/// Each cause with its parameters.
pub(super) fn findings(findings: &[Finding], scales: &Scales) -> Markup {
    if findings.is_empty() {
        return html! { p { "No cause was found." } };
    }
    let mut table = candidates("probability", scales);
    for finding in findings {
        let parameters = finding.parameters.iter().map(|(name, parameter)| {
            format!("{} = {}", shown_name(name, parameter.dimension, scales), interval(parameter, scales))
        });
        let cells = [
            html! { (finding.cause) },
            html! { (format!("{:.3}", finding.probability)) },
            list(parameters),
            html! { (number(finding.rmse_before)) },
            html! { (number(finding.rmse_after)) },
        ];
        table.row(Row::new(cells).class("noted").note(html! { (finding.evidence) "." }));
    }
    table.markup()
}

/// An empty table of causes, each with a number that tells how sure it is, its parameters and the errors without and with it.
pub(super) fn candidates(how_sure: &str, scales: &Scales) -> Table {
    let unit = scales.unit(Dimension::ReadingSize);
    Table::default()
        .column("cause", "cause")
        .column(how_sure, "number")
        .column("parameters with 95 % intervals", "")
        .column(&format!("RMSE without [{unit}]"), "number")
        .column(&format!("with [{unit}]"), "number")
}

/// Texts below each other.
pub(super) fn list(lines: impl IntoIterator<Item = String>) -> Markup {
    html! { ul.parameters { @for line in lines { li { (line) } } } }
}

/// The best sets of causes, each with its distance from the best and the cause that it lacks.
pub(super) fn standings(diagnosis: &Diagnosis) -> Markup {
    let standings = &diagnosis.ranking;
    let unit = diagnosis.data.scales().unit(Dimension::ReadingSize);
    let Some(best) = standings.first() else {
        return html! { p { "No causes were compared: the record has too little excitation." } };
    };
    let behind = |standing: &Standing| best.score - standing.score;
    let furthest = standings.iter().map(behind).fold(1.0, f64::max);
    // Rivals are a few nats behind, wrong causes thousands, so the bars are logarithmic.
    let width = |nats: f64| format!("width:{:.1}%", 100.0 * nats.ln_1p() / furthest.ln_1p());
    let mut table = Table::default()
        .column("causes", "set")
        .column("behind [nats]", "number")
        .column("", "bar")
        .column(&format!("RMSE [{unit}]"), "number")
        .column(&format!("held-out RMSE [{unit}]"), "number")
        .column("", "small remark");
    for (place, standing) in standings.iter().enumerate() {
        let cells = [
            html! { (set(&standing.causes)) div.small { (values(&standing.values)) } },
            html! { (format!("{:.1}", behind(standing))) },
            html! { i style=(width(behind(standing))) {} },
            html! { (number(standing.rmse)) },
            html! { (number(standing.held_out_rmse)) },
            html! { (note(standing, place)) },
        ];
        table.row(Row::new(cells).class(if place == 0 { "best" } else { "" }));
    }
    if let Some(linear) = &diagnosis.report.linear {
        let errors = [linear.rmse, linear.held_out_rmse].map(|error| html! { (number(error)) });
        let name = html! { "best linear model, order " (linear.order) };
        table.row(Row::new([name, html! {}, html! {}].into_iter().chain(errors).chain([html! { "no causes" }])));
    }
    html! {
        p.small {
            "Distance from the best set in held-out log-likelihood, in nats, after a penalty for each cause; bars are logarithmic. "
            "3 nats are odds of 20 to 1."
        }
        (table.markup())
    }
}

fn set(causes: &[&str]) -> String {
    if causes.is_empty() { "none: the original simulation".to_owned() } else { causes.join(" + ") }
}

/// A list of values, none of which is broken across lines.
fn values(list: &str) -> Markup {
    html! {
        @for (place, value) in list.split(", ").enumerate() {
            @if place > 0 { ", " }
            span.whole { (value) }
        }
    }
}

fn note(standing: &Standing, place: usize) -> String {
    match (place, standing.best_without.as_slice()) {
        (0, _) => "best".to_owned(),
        (_, []) => String::new(),
        (_, without) => format!("best without {}", without.join(", ")),
    }
}

/// Accuracy of the simulation, and of the extended one if there is one.
pub(super) fn quality(diagnosis: &Diagnosis) -> Markup {
    let (report, extended) = (&diagnosis.report, is_extended(diagnosis));
    let (before, after) = (&report.baseline, &report.extended.quality);
    // Readings that are all equal have no spread to compare errors with.
    let spread = diagnosis.data.reading.windows(2).any(|pair| pair[0] != pair[1]);
    let of_spread = |percent| if spread { number(percent) } else { "-".to_owned() };
    let unit = diagnosis.data.scales().unit(Dimension::ReadingSize);
    let error = |of: &str| format!("{of} RMSE [{unit}]");
    let linear = report.linear.as_ref();
    let of_linear = |of: fn(&LinearError) -> f64| linear.map(|linear| number(of(linear)));
    let rows = [
        (error("free-run"), number(before.rmse), number(after.rmse), of_linear(|linear| linear.rmse)),
        (
            error("held-out"),
            number(before.held_out_rmse),
            number(after.held_out_rmse),
            of_linear(|linear| linear.held_out_rmse),
        ),
        (error("one-step"), number(before.one_step_rmse), number(after.one_step_rmse), None),
        ("fit [%]".to_owned(), of_spread(before.fit_percent), of_spread(after.fit_percent), None),
    ];
    let mut table = Table::default().column("", "").column("simulation", "number before");
    if extended {
        table = table.column("extended", "number after");
    }
    if let Some(linear) = linear {
        table = table.column(&linear_name(linear), "number");
    }
    let improvement = extended.then(|| {
        let linear = linear.map(|linear| improvement(before.held_out_rmse, linear.held_out_rmse));
        let extended = format!("{:.1}", 100.0 * report.extended.gain);
        ("held-out improvement [%]".to_owned(), String::new(), extended, linear)
    });
    for (what, before, after, of_linear) in rows.into_iter().chain(improvement) {
        let errors = [Some(before), extended.then_some(after), linear.map(|_| of_linear.unwrap_or_default())];
        table.row(Row::new(std::iter::once(what).chain(errors.into_iter().flatten()).map(|text| html! { (text) })));
    }
    table.markup()
}

/// Error of both simulations on each fold.
pub(super) fn folds(diagnosis: &Diagnosis) -> Markup {
    let Diagnosis { data, held_out: [before, after], .. } = diagnosis;
    let of = |fold: usize, residual: &[f64]| -> Vec<f64> {
        residual.iter().zip(&data.fold).filter(|(_, of)| usize::from(**of) == fold).map(|(left, _)| *left).collect()
    };
    let rows: Vec<(usize, usize, f64, f64)> = (0..data.folds)
        .map(|fold| {
            let (before, after) = (of(fold, before), of(fold, after));
            (fold + 1, before.len(), root_mean_square(&before), root_mean_square(&after))
        })
        .collect();
    let largest = rows.iter().map(|row| row.2.max(row.3)).fold(1e-12, f64::max);
    let width = |rmse: f64| format!("width:{:.1}%", 100.0 * rmse / largest);
    let unit = data.scales().unit(Dimension::ReadingSize);
    let mut table = Table::default()
        .column("fold", "number")
        .column("rows", "number")
        .column(&format!("simulation [{unit}]"), "number before")
        .column(&format!("extended [{unit}]"), "number after")
        .column("", "bar")
        .column("improvement [%]", "number");
    for (fold, rows, before, after) in rows {
        table.row(Row::new([
            html! { (fold) },
            html! { (rows) },
            html! { (number(before)) },
            html! { (number(after)) },
            html! { i.before style=(width(before)) {} i style=(width(after)) {} },
            html! { (improvement(before, after)) },
        ]));
    }
    if let Some(linear) = &diagnosis.report.linear {
        table.row(Row::new([
            html! { "all, " (linear_name(linear)) },
            html! {},
            html! {},
            html! { (number(linear.held_out_rmse)) },
            html! { i style=(width(linear.held_out_rmse.min(largest))) {} },
            html! { (improvement(diagnosis.report.baseline.held_out_rmse, linear.held_out_rmse)) },
        ]));
    }
    table.markup()
}

/// Improvement in percent; `-` for a fold without error.
fn improvement(before: f64, after: f64) -> String {
    if before > 0.0 { format!("{:.1}", 100.0 * (1.0 - after / before)) } else { "-".to_owned() }
}

/// The noise model.
pub(super) fn noise(diagnosis: &Diagnosis) -> Markup {
    let (noise, scales) = (&diagnosis.report.noise, diagnosis.data.scales());
    let unit = scales.unit(Dimension::ReadingSize);
    let tail = match noise.tail {
        Some(freedom) => format!("Student's t distribution with {} degrees of freedom", number(freedom)),
        None => "normal distribution".to_owned(),
    };
    let autocorrelation = match noise.memory_rows {
        0 => "no autocorrelation".to_owned(),
        1 => "autocorrelated over one row".to_owned(),
        rows => format!("autocorrelated over {rows} rows"),
    };
    let wide = diagnosis.extended.noise.outliers.map(|(fraction, wide)| {
        let wide = scales.restored(Dimension::ReadingSize, wide);
        format!(" {} % of the readings are outliers with a scale of {} {unit}.", number(100.0 * fraction), number(wide))
    });
    html! { p { "Scale " (number(noise.sigma)) " " (unit) ", " (tail) ", " (autocorrelation) "." (wide.unwrap_or_default()) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fold_without_error_has_no_improvement() {
        assert_eq!([improvement(0.0, 0.0), improvement(4.0, 1.0), improvement(1.0, 2.0)], ["-", "75.0", "-100.0"]);
    }

    #[test]
    fn a_rival_is_noted_with_the_causes_that_it_is_the_best_without() {
        let standing = |best_without: &[&'static str]| Standing {
            causes: Vec::new(),
            best_without: best_without.to_vec(),
            values: String::new(),
            score: 0.0,
            rmse: 1.0,
            held_out_rmse: 1.0,
        };
        let notes = [note(&standing(&[]), 0), note(&standing(&["hum", "drift"]), 1), note(&standing(&[]), 2)];
        assert_eq!(notes, ["best", "best without hum, drift", ""]);
    }
}
