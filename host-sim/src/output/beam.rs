//! The answer of `vsj beam` as text.

use std::fmt::Write;

use paper::beam::experiment::Experiment;
use paper::beam::readings::Reading;
use paper::beam::regression::Interval;
use paper::beam::report::{self, Layers, Statics};
use paper::beam::slip::{Identified, Predicted};

/// Tables of the experiment, the beam of one material, and the stack.
pub fn text(report: &report::Report) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut text, report);
    text
}

fn write(out: &mut String, report: &report::Report) -> std::fmt::Result {
    experiment(out, &report.experiment)?;
    deflection(out, &report.deflection)?;
    layers(out, &report.layers)
}

fn experiment(out: &mut String, experiment: &Experiment) -> std::fmt::Result {
    writeln!(out, "Beam experiment (95 % intervals)")?;
    writeln!(out, "  voltage | spring constant, all readings |         without the outliers | Young's modulus")?;
    writeln!(out, "      [V] |                     [uN/mm] |                      [uN/mm] |           [GPa]")?;
    for line in &experiment.lines {
        writeln!(
            out,
            "  {:7} | {:>29} | {:>28} | {}",
            line.voltage_v,
            plus_minus(&line.all_un_per_mm, 2),
            plus_minus(&line.un_per_mm, 2),
            plus_minus(&line.youngs_modulus_pa.scaled(1e-9), 3)
        )?;
    }
    for out_of_line in &experiment.out_of_line {
        let Reading { voltage_v, displacement_mm, force_un } = out_of_line.reading;
        writeln!(
            out,
            "Outlier: {force_un} uN at {displacement_mm:.2} mm, {voltage_v} V; the others predict {:.0} to {:.0} uN (p-value \
             {:.0e}).",
            out_of_line.expected_un.low, out_of_line.expected_un.high, out_of_line.chance
        )?;
    }
    writeln!(
        out,
        "E(V) = {} GPa + {} MPa/V V",
        plus_minus(&experiment.at_zero_pa.scaled(1e-9), 4),
        plus_minus(&experiment.per_volt_pa.scaled(1e-6), 4)
    )?;
    if let Some(chance) = experiment.straight_chance.filter(|&chance| chance < 0.01) {
        writeln!(out, "E(V) is not quite linear: its slope decreases (p-value of a linear E(V) {chance:.0e}).")?;
    }
    let [low, high] = &experiment.reach_n_per_m;
    writeln!(
        out,
        "Stiffness range: {} to {} N/m, a ratio of {}.",
        plus_minus(low, 4),
        plus_minus(high, 4),
        plus_minus(&experiment.reach_ratio, 3)
    )
}

fn deflection(out: &mut String, deflection: &Statics) -> std::fmt::Result {
    writeln!(out, "\nBeam of one material, clamped at one end (upwards is positive)")?;
    writeln!(out, "  along the beam | linear |  exact, at a distance | valid")?;
    writeln!(out, "            [mm] |   [mm] |   [mm]           [mm] |  [mm]")?;
    for place in &deflection.places {
        writeln!(
            out,
            "  {:14.2} | {:6.2} | {:6.2} {:14.2} | {:5.2}",
            place.at_mm, place.linear_mm, place.exact_mm, place.exact_x_mm, place.valid_mm
        )?;
    }
    let Statics { linear_error, tolerance, .. } = deflection;
    writeln!(
        out,
        "{}: the linear result differs by {:.1} % of the largest displacement, the tolerance is {:.1} %.",
        if deflection.droops {
            "The beam droops, the large-deflection solution is valid"
        } else {
            "The linear solution is valid"
        },
        1e2 * linear_error,
        1e2 * tolerance
    )?;
    if let Some(factor) = deflection.limit_factor {
        writeln!(out, "The linear solution is valid up to {factor:.3} times this load (force and weight together).")?;
    }
    Ok(())
}

fn layers(out: &mut String, layers: &Layers) -> std::fmt::Result {
    writeln!(out, "\nStack of layers, by finite elements with slip")?;
    writeln!(out, "  voltage | measured |  bonded | sliding | only active | coupling grows with |")?;
    writeln!(out, "      [V] |  [uN/mm] |         |         | layer grows | V        V squared  |")?;
    for line in &layers.identified.lines {
        writeln!(
            out,
            "  {:7} | {:8.1} | {:7.1} | {:7.1} | {:11.1} | {:7.1} {:11.1} | {}",
            line.voltage_v,
            line.measured,
            line.bonded,
            line.sliding,
            line.active_only,
            line.linear,
            line.quadratic,
            if line.used { "identified here" } else { "check" }
        )?;
    }
    let Identified { at_lowest_pa_per_m, lowest_v, at_highest_pa_per_m, highest_v, active_alone_pa, .. } =
        &layers.identified;
    writeln!(
        out,
        "Interlayer stiffness {} Pa/m at {lowest_v} V, {} Pa/m at {highest_v} V. Bonded layers are {:.1} times too stiff.",
        span(at_lowest_pa_per_m),
        span(at_highest_pa_per_m),
        layers.bonded_by_measured
    )?;
    match active_alone_pa {
        Some(pascal) => writeln!(
            out,
            "The active layer alone would need {:.1} GPa at {highest_v} V: in this model the voltage acts on the coupling.",
            1e-9 * pascal
        )?,
        None => writeln!(
            out,
            "No stiffness of the active layer alone gives the measured spring constant at {highest_v} V."
        )?,
    }
    tips(out, &layers.identified.tips)?;
    let Layers { voltage_v, interlayer_pa_per_m, tip_mm, bonded_mm, sliding_mm, .. } = layers;
    writeln!(
        out,
        "Under the given force at {voltage_v} V, {interlayer_pa_per_m:.3e} Pa/m: {tip_mm:.3} mm ({bonded_mm:.3} bonded, \
         {sliding_mm:.3} sliding), small deflections."
    )
}

/// The displacements of the free end, computed and as the report prints them.
fn tips(out: &mut String, tips: &[Predicted]) -> std::fmt::Result {
    if tips.is_empty() {
        return Ok(());
    }
    writeln!(out, "\n  force | voltage | measured |   slip |  error | report's FEM |  error | bonded")?;
    writeln!(out, "   [uN] |     [V] |     [mm] |   [mm] |    [%] |         [mm] |    [%] |   [mm]")?;
    for tip in tips {
        let off = |value: f64| 1e2 * (value / tip.printed.measured_mm - 1.0);
        writeln!(
            out,
            "  {:5} | {:7} | {:8.2} | {:6.3} | {:+6.1} | {:12.3} | {:+6.1} | {:6.3}",
            tip.printed.force_un,
            tip.printed.voltage_v,
            tip.printed.measured_mm,
            tip.slip_mm,
            off(tip.slip_mm),
            tip.printed.fem_mm,
            off(tip.printed.fem_mm),
            tip.bonded_mm
        )?;
    }
    Ok(())
}

fn plus_minus(interval: &Interval, decimals: usize) -> String {
    format!("{:.decimals$} +- {:.decimals$}", interval.value, interval.high - interval.value)
}

fn span(interval: &Interval) -> String {
    format!("{:.3e} ({:.3e} to {:.3e})", interval.value, interval.low, interval.high)
}
