//! The answer of `vsj dynamics` as text and as CSV.

use std::fmt::Write;

use paper::dynamics::report::{self, Model};
use paper::dynamics::zener::Zener;

/// Table of the response, followed by the equivalent parameters.
pub fn text(report: &report::Report) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut text, report);
    text
}

fn write(out: &mut String, report: &report::Report) -> std::fmt::Result {
    writeln!(out, "{} driven by {}", report.model.name(), report.input)?;
    let unit = if report.model == Model::PiPlant { "  output [V]" } else { "stiffness [N/m]" };
    writeln!(out, "  time [s] |  level | elongation [m] | {unit}")?;
    for row in &report.rows {
        let elongation = row.elongation_m.map_or_else(|| "-".to_owned(), |m| format!("{m:.5}"));
        let stiffness = if row.stiffness.is_finite() { format!("{:.5}", row.stiffness) } else { "-".to_owned() };
        writeln!(out, "  {:8.2} | {:6.3} | {elongation:>14} | {stiffness:>12}", row.time_s, row.level)?;
    }
    let report::Report { plant, share, tau_s, zener_of_plant, stand_in, .. } = report;
    if matches!(report.model, Model::Zener | Model::Analogue) {
        writeln!(
            out,
            "Under a changing force this Zener model, at level 1, is exactly the plant with Kp = {:.4}, Ki = {:.4} 1/s: \
             {:.2} % instantaneous, the rest with a time constant of {tau_s:.3} s.",
            plant.proportional,
            plant.integral_per_s,
            1e2 * share
        )?;
    }
    if report.model == Model::SpringDamper {
        writeln!(
            out,
            "Without the series spring there is no instantaneous part: no plant with Kp > 0 is equivalent to this model."
        )?;
    }
    if let Some(difference) = report.analogue_difference {
        writeln!(
            out,
            "Zener model and circuit differ by at most {difference:.1e} of the largest elongation at any moment shown."
        )?;
    }
    let Zener { k1_n_per_m, k2_n_per_m, damper_n_s_per_m, .. } = zener_of_plant;
    writeln!(
        out,
        "The given plant is equivalent to the Zener model with K1 = {k1_n_per_m:.4} N/m, K2 = {k2_n_per_m:.4} N/m, D = \
         {damper_n_s_per_m:.4} N s/m (K1 = K2 / Kp, D = tau K2)."
    )?;
    writeln!(
        out,
        "If instead both springs change under a constant force, it approximates that model within 1 % of the change up to a \
         ratio of {:.3}, within 5 % up to {:.3}. At this material's ratio of {:.3} the error is {:.1} % upwards and {:.1} % \
         downwards: the model is faster where it is stiffer, the plant is not.",
        stand_in.ratio_at_1_percent,
        stand_in.ratio_at_5_percent,
        stand_in.material_ratio,
        stand_in.material_up_percent,
        stand_in.material_down_percent
    )
}

/// The response as CSV.
pub fn csv(report: &report::Report) -> String {
    let mut csv =
        format!("# {} driven by {}\ntime_s,level,elongation_m,stiffness\n", report.model.name(), report.input);
    for row in &report.rows {
        let elongation = row.elongation_m.map(|m| format!("{m:.9}")).unwrap_or_default();
        let stiffness = if row.stiffness.is_finite() { format!("{:.9}", row.stiffness) } else { String::new() };
        let _ = writeln!(csv, "{:.6},{:.6},{elongation},{stiffness}", row.time_s, row.level);
    }
    csv
}
