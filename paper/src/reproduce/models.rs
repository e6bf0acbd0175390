//! Printed numbers that a model of this project computes.

use anyhow::{Context, Result, bail};
use model::{Gains, Plant};

use crate::beam::cantilever::{Beam, Load};
use crate::beam::limits::bonded_n_per_m;
use crate::beam::regression::Fit;
use crate::beam::stack::{Layer, Stack};
use crate::dynamics::plant::PlantGains;
use crate::reproduce::inputs::Inputs;
use crate::table3;
use simulation::experiment::reference_at;
use simulation::reference::Loop;
use simulation::schedule::{Change, Schedule};

/// A beam by its dimensions. A missing length is 1 m, a missing Young's modulus 1 Pa, a missing density 0.
///
/// # Errors
/// If width or thickness is missing, or a value is out of range.
pub(crate) fn whole_beam(inputs: &Inputs<'_>) -> Result<Beam> {
    let or = |name: &str, otherwise: f64| inputs.number(name).unwrap_or(otherwise);
    let beam = Beam {
        length_m: 1e-3 * or("length_mm", 1e3),
        width_m: 1e-3 * inputs.number("width_mm")?,
        thickness_m: 1e-6 * inputs.number("thickness_um")?,
        youngs_modulus_pa: 1e9 * or("youngs_modulus_gpa", 1e-9),
        density_kg_per_m3: or("density_kg_per_m3", 0.0),
    };
    beam.checked()
}

/// Tip displacement of a beam under force and weight, in mm, positive upwards, by the linear theory.
pub(crate) fn beam_tip_mm(inputs: &Inputs<'_>) -> Result<f64> {
    let beam = whole_beam(inputs)?;
    let load = Load { tip_n: 1e-6 * inputs.number("force_un")?, gravity_m_per_s2: inputs.number("gravity_m_per_s2")? };
    Ok(1e3 * beam.linear_m(&load, beam.length_m))
}

/// Tip displacement in mm of the report's stack with bonded layers, whose moduli are the inputs `<material>_gpa`.
pub(crate) fn bonded_tip_mm(inputs: &Inputs<'_>) -> Result<f64> {
    let layer = |layer: &Layer| {
        let gpa = inputs.number(&format!("{}_gpa", layer.material.to_lowercase()))?;
        Ok(Layer { youngs_modulus_pa: 1e9 * gpa, ..layer.clone() })
    };
    let stack = Stack::new(Stack::paper()?.layers().iter().map(layer).collect::<Result<_>>()?)?;
    Ok(1e3 * inputs.number("force_n")? / bonded_n_per_m(&stack))
}

/// The report's loop, `with` its controller or `without`.
fn system(controller: &str) -> Result<Loop> {
    let gains = match controller {
        "with" => Some((Gains::PAPER.proportional, Gains::PAPER.integral_per_s)),
        "without" => None,
        other => bail!("no controller is called `{other}`"),
    };
    Ok(free(Plant::PAPER, gains))
}

/// A loop behind an amplifier without limits.
pub(super) fn free(plant: Plant, gains: Option<(f64, f64)>) -> Loop {
    let Plant { share, time_constant_s } = plant;
    let everything = (f64::NEG_INFINITY, f64::INFINITY);
    Loop { share, time_constant_s, gains, range_v: everything, slew_v_per_s: f64::INFINITY }
}

/// Stiffness of the stair experiment, in V, at a time.
pub(crate) fn stair_at(inputs: &Inputs<'_>) -> Result<f64> {
    let found = reference_at(system(inputs.word("controller")?)?, &Schedule::stair(), [inputs.number("time_s")?]);
    found.first().copied().context("one moment")
}

/// Voltage of Appendix 8.1.2 at a time, in V, interpolated linearly.
pub(crate) fn stair_voltage(inputs: &Inputs<'_>) -> Result<f64> {
    Ok(Schedule::stair().reader().at(inputs.number("time_s")?))
}

/// A step of the stair, counted from 1.
fn step(inputs: &Inputs<'_>) -> Result<Change> {
    let number = inputs.number("step")? as usize;
    let changes = Schedule::stair().changes();
    changes.get(number.wrapping_sub(1)).copied().with_context(|| format!("the stair has no step {number}"))
}

/// Completed part of a step, at times in s after its start.
fn parts(controller: &str, change: &Change, seconds: impl IntoIterator<Item = f64>) -> Result<Vec<f64>> {
    let times = seconds.into_iter().map(|seconds| change.start_s + seconds);
    let found = reference_at(system(controller)?, &Schedule::stair(), times);
    Ok(found.into_iter().map(|y| (y - change.from_v) / (change.to_v - change.from_v)).collect())
}

/// Time in s from the start of a step until a part of it is completed; infinite if the next step comes first.
pub(crate) fn time_to(controller: &str, inputs: &Inputs<'_>) -> Result<f64> {
    let (change, part) = (step(inputs)?, inputs.number("part")?);
    let ticks = ((change.end_s - change.start_s) * 1e3) as usize;
    let made = parts(controller, &change, (0..ticks).map(|tick| 1e-3 * tick as f64))?;
    let Some(after) = made.iter().position(|&made| made >= part) else { return Ok(f64::INFINITY) };
    let Some(before) = after.checked_sub(1) else { return Ok(0.0) };
    let missing = (made[after] - part) / (made[after] - made[before]);
    Ok(1e-3 * (after as f64 - missing))
}

/// Completed part of a step some seconds after its start, in percent.
pub(crate) fn part_after_percent(inputs: &Inputs<'_>) -> Result<f64> {
    let made = parts(inputs.word("controller")?, &step(inputs)?, [inputs.number("seconds")?])?;
    Ok(1e2 * made.first().context("one moment")?)
}

/// Time in s after which the report's spring without controller has completed a part of an ideal step.
pub(crate) fn settled_after_s(part: f64) -> f64 {
    let Plant { share, time_constant_s } = Plant::PAPER;
    time_constant_s * ((1.0 - share) / (1.0 - part)).ln().max(0.0)
}

/// A gain of the proportional-integral plant, fitted by least squares to the printed column without controller.
///
/// Gauss-Newton with finite differences, from a start that is independent of the result.
pub(crate) fn plant_gain(inputs: &Inputs<'_>) -> Result<f64> {
    let rows = table3::rows()?;
    let misses = |[proportional, integral_per_s]: [f64; 2]| -> Vec<f64> {
        let plant = PlantGains { proportional, integral_per_s }.plant();
        let found = reference_at(free(plant, None), &Schedule::stair(), rows.iter().map(|row| row.time_s));
        found.iter().zip(&rows).map(|(found, row)| found - row.without).collect()
    };
    let mut gains = [0.5, 0.5];
    for _ in 0..50 {
        let here = misses(gains);
        let slopes = [0, 1].map(|index| {
            let mut moved = gains;
            moved[index] *= 1.0 + 1e-6;
            let step = moved[index] - gains[index];
            misses(moved).iter().zip(&here).map(|(there, here)| (there - here) / step).collect::<Vec<f64>>()
        });
        let design: Vec<Vec<f64>> = slopes[0].iter().zip(&slopes[1]).map(|(&p, &i)| vec![p, i]).collect();
        let change = Fit::new(&design, &here)?.coefficients;
        // The gains must remain positive.
        gains = [0, 1].map(|index| (gains[index] - change[index]).max(0.2 * gains[index]));
        if change.iter().zip(&gains).all(|(change, gain)| change.abs() < 1e-9 * gain) {
            break;
        }
    }
    match inputs.word("which")? {
        "proportional" => Ok(gains[0]),
        "integral" => Ok(gains[1]),
        other => bail!("the plant has no gain `{other}`"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_gains_are_recovered_from_the_table() {
        for (which, expected) in [("proportional", 0.1), ("integral", 0.2)] {
            let inputs = [("which".to_owned(), toml::Value::String(which.to_owned()))].into();
            let found = plant_gain(&Inputs(&inputs)).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-3, "{which}: {found}");
        }
    }

    /// An ideal step reaches 97 % after 5.5 s ln((10/11) / 0.03).
    #[test]
    fn settling_time_agrees_with_the_closed_form() {
        assert!((settled_after_s(0.97) - 18.762).abs() < 1e-3);
        assert_eq!(settled_after_s(0.05), 0.0);
    }
}
