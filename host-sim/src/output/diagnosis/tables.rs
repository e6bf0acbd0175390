//! The tables of the report page.

use maud::{Markup, html};

use crate::output::diagnosis::extension::is_extended;
use crate::output::diagnosis::number::{interval, number, shown_name};
use crate::output::diagnosis::text::linear_name;
use identify::answer::{Finding, LinearError};
use identify::dimension::Dimension;
use identify::record::scales::Scales;
use identify::stats::scale::root_mean_square;
use identify::verdict::diagnosis::Diagnosis;
use identify::verdict::ranking::RankedCauses as Standing;

/// Each cause with its parameters.
pub(super) fn findings(findings: &[Finding], scales: &Scales) -> Markup {
    let unit = scales.unit(Dimension::ReadingSize);
    if findings.is_empty() {
        return html! { p { "No cause was found." } };
    }
    html! {
        div.scroll { table {
            thead { tr {
                th { "cause" } th.number { "probability" } th { "parameters with 95 % intervals" }
                th.number { "RMSE without [" (unit) "]" } th.number { "with [" (unit) "]" }
            } }
            tbody {
                @for finding in findings {
                    tr.cause {
                        td.cause { (finding.cause) }
                        td.number { (format!("{:.3}", finding.probability)) }
                        td { ul.parameters {
                            @for (name, parameter) in &finding.parameters { li {
                                (shown_name(name, parameter.dimension, scales)) " = " (interval(parameter, scales))
                            } }
                        } }
                        td.number { (number(finding.rmse_before)) }
                        td.number { (number(finding.rmse_after)) }
                    }
                    tr { td.small colspan="5" { div.evidence { (finding.evidence) "." } } }
                }
            }
        } }
    }
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
    html! {
        p.small {
            "Distance from the best set in held-out log-likelihood, in nats, after a penalty for each cause; bars are logarithmic. "
            "3 nats are odds of 20 to 1."
        }
        div.scroll { table {
            thead { tr {
                th { "causes" } th.number { "behind [nats]" } th { "" } th.number { "RMSE [" (unit) "]" }
                th.number { "held-out RMSE [" (unit) "]" } th { "" }
            } }
            tbody {
                @for (place, standing) in standings.iter().enumerate() {
                    tr.best[place == 0] {
                        td.set { (set(&standing.causes)) div.small.note { (values(&standing.values)) } }
                        td.number { (format!("{:.1}", behind(standing))) }
                        td.bar { i style=(width(behind(standing))) {} }
                        td.number { (number(standing.rmse)) }
                        td.number { (number(standing.held_out_rmse)) }
                        td.small.note { (note(standing, place)) }
                    }
                }
                @if let Some(linear) = &diagnosis.report.linear {
                    tr.linear {
                        td.set { "best linear model, order " (linear.order) } td.number {} td.bar {}
                        td.number { (number(linear.rmse)) } td.number { (number(linear.held_out_rmse)) }
                        td.small.note { "no causes" }
                    }
                }
            }
        } }
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
    html! {
        div.scroll { table {
            thead { tr {
                th { "" } th.number.before { "simulation" } @if extended { th.number.after { "extended" } }
                @if let Some(linear) = linear { th.number { (linear_name(linear)) } }
            } }
            tbody {
                @for (what, before, after, of_linear) in rows {
                    tr {
                        td { (what) } td.number { (before) } @if extended { td.number { (after) } }
                        @if linear.is_some() { td.number { (of_linear.unwrap_or_default()) } }
                    }
                }
                @if extended {
                    tr {
                        td { "held-out improvement [%]" } td {} td.number { (format!("{:.1}", 100.0 * report.extended.gain)) }
                        @if let Some(linear) = linear { td.number { (gain(before.held_out_rmse, linear.held_out_rmse)) } }
                    }
                }
            }
        } }
    }
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
    html! {
        div.scroll { table {
            thead { tr {
                th.number { "fold" } th.number { "rows" } th.number.before { "simulation [" (unit) "]" } th.number.after { "extended [" (unit) "]" } th { "" }
                th.number { "improvement [%]" }
            } }
            tbody {
                @for (fold, rows, before, after) in rows {
                    tr {
                        td.number { (fold) } td.number { (rows) }
                        td.number { (number(before)) } td.number { (number(after)) }
                        td.bar { i.before style=(width(before)) {} i style=(width(after)) {} }
                        td.number { (gain(before, after)) }
                    }
                }
                @if let Some(linear) = &diagnosis.report.linear {
                    tr.linear {
                        td colspan="2" { "all, " (linear_name(linear)) } td.number {} td.number { (number(linear.held_out_rmse)) }
                        td.bar { i style=(width(linear.held_out_rmse.min(largest))) {} }
                        td.number { (gain(diagnosis.report.baseline.held_out_rmse, linear.held_out_rmse)) }
                    }
                }
            }
        } }
    }
}

/// Improvement in percent; `-` for a fold without error.
fn gain(before: f64, after: f64) -> String {
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
        assert_eq!([gain(0.0, 0.0), gain(4.0, 1.0), gain(1.0, 2.0)], ["-", "75.0", "-100.0"]);
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
