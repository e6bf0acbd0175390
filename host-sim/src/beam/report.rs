//! What `vsj beam` says: text, JSON and figures.

use std::fmt::Write;

use anyhow::Result;
use serde::Serialize;

use super::cantilever::{Beam, Load};
use super::droop::{Deflection, Place, limit};
use super::experiment::{Experiment, Reading};
use super::layered::{self, bend, bonded_n_per_m, sliding_n_per_m};
use super::regression::Interval;
use super::slip::Identified;
use super::stack::{ACTIVE, Stack, active_modulus_pa};
use crate::output::figure::Figure;

/// What is asked.
pub struct Question {
    /// Readings of the beam experiment.
    pub readings: Vec<Reading>,
    /// The stack they were made on, without voltage.
    pub stack: Stack,
    /// A beam of one material.
    pub beam: Beam,
    /// Its load; the tip force also bends the stack.
    pub load: Load,
    /// Error of the linear theory that is tolerated, by the largest displacement.
    pub tolerance: f64,
    /// Places to print, in m from the clamp.
    pub at_m: Vec<f64>,
    /// Voltage across the stack, in V.
    pub voltage_v: f64,
    /// Interlayer stiffness, in Pa/m; `None` for the identified one.
    pub interlayer_pa_per_m: Option<f64>,
    /// Finite elements along the stack.
    pub elements: usize,
}

/// The whole answer of `vsj beam --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The beam experiment and the voltage law.
    pub experiment: Experiment,
    /// The beam of one material under its load.
    pub deflection: Statics,
    /// The stack of layers.
    pub layers: Layers,
}

/// The beam of one material.
#[derive(Clone, Debug, Serialize)]
pub struct Statics {
    /// Largest difference between linear and exact displacement, by the largest exact one.
    pub linear_error: f64,
    /// What of it is tolerated.
    pub tolerance: f64,
    /// True if the linear result is not valid: the large-deflection one is the answer.
    pub droops: bool,
    /// How many times this load the linear theory is just valid; `None` without load.
    pub limit_factor: Option<f64>,
    /// Places along the beam.
    pub places: Vec<Place>,
    #[serde(skip)]
    shape: Vec<[f64; 4]>,
}

/// The stack.
#[derive(Clone, Debug, Serialize)]
pub struct Layers {
    /// Slip as the experiment says.
    pub identified: Identified,
    /// Bonded, by measured spring constant without voltage.
    pub bonded_by_measured: f64,
    /// The voltage asked for, in V.
    pub voltage_v: f64,
    /// The interlayer stiffness used, in Pa/m.
    pub interlayer_pa_per_m: f64,
    /// Tip displacement under the force asked for, in mm.
    pub tip_mm: f64,
    /// The same with bonded layers.
    pub bonded_mm: f64,
    /// The same with layers that slide freely.
    pub sliding_mm: f64,
    /// Name and points, in mm, of the shapes to be drawn.
    #[serde(skip)]
    shapes: Vec<(&'static str, Vec<(f64, f64)>)>,
}

impl Report {
    /// Answers.
    ///
    /// # Errors
    /// [`crate::BadInput`] that names what cannot be.
    pub fn new(question: &Question) -> Result<Self> {
        let Question { readings, stack, beam, load, tolerance, at_m, voltage_v, interlayer_pa_per_m, elements } =
            question;
        let bent = Deflection::new(beam, load, *tolerance)?;
        let deflection = Statics {
            linear_error: bent.linear_error,
            tolerance: *tolerance,
            droops: bent.droops,
            limit_factor: limit(beam, load, *tolerance)?,
            places: at_m.iter().map(|&at| bent.at(at)).collect::<Result<_>>()?,
            shape: bent
                .exact()
                .iter()
                .step_by(10)
                .map(|point| [point.arc_m, beam.linear_m(load, point.arc_m), point.x_m, point.y_m].map(|m| 1e3 * m))
                .collect(),
        };

        let whole = Beam { length_m: stack.length_m(), thickness_m: stack.thickness_m(), ..*beam };
        let widest = stack.layers().iter().map(|layer| layer.width_m).fold(0.0, f64::max);
        let experiment = Experiment::new(readings, &Beam { width_m: widest, ..whole }.checked()?)?;
        let identified = Identified::new(stack, &experiment)?;
        super::check("voltage_v", *voltage_v, 0.0..=1000.0, "V")?;
        let interlayer = interlayer_pa_per_m.unwrap_or_else(|| identified.interlayer_pa_per_m(*voltage_v));
        let stiffened = stack.with_modulus(ACTIVE, active_modulus_pa(*voltage_v)?)?;
        let bent = bend(&stiffened, interlayer, load.tip_n, *elements)?;
        let mm = |n_per_m: f64| 1e3 * load.tip_n / n_per_m;
        let mut shapes = Vec::new();
        for (name, interlayer) in [("with slip", interlayer), ("bonded", 1e14), ("sliding", 0.0)] {
            let nodes = bend(&stiffened, interlayer, load.tip_n, *elements)?.nodes;
            shapes.push((name, nodes.iter().map(|&(x, w)| (1e3 * x, 1e3 * w)).collect()));
        }
        let layers = Layers {
            bonded_by_measured: identified.lines.first().map_or(f64::NAN, |line| line.bonded / line.measured),
            identified,
            voltage_v: *voltage_v,
            interlayer_pa_per_m: interlayer,
            tip_mm: 1e3 * bent.tip_m(),
            bonded_mm: mm(bonded_n_per_m(&stiffened)),
            sliding_mm: mm(sliding_n_per_m(&stiffened)),
            shapes,
        };
        Ok(Self { experiment, deflection, layers })
    }

    /// For the terminal.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let Self { experiment, deflection, layers } = self;
        writeln!(out, "Beam experiment (95 % intervals)")?;
        writeln!(out, "  voltage | spring constant, all readings | without readings out of line | Young's modulus")?;
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
                "Out of line: {force_un} uN at {displacement_mm:.2} mm, {voltage_v} V; the others say {:.0} to {:.0} uN \
                 (chance of such a reading {:.0e}).",
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
            writeln!(out, "E(V) is not quite straight: it flattens (chance of that by scatter alone {chance:.0e}).")?;
        }
        let [low, high] = &experiment.reach_n_per_m;
        writeln!(
            out,
            "Within reach: {} to {} N/m, a ratio of {}.",
            plus_minus(low, 4),
            plus_minus(high, 4),
            plus_minus(&experiment.reach_ratio, 3)
        )?;

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
            "{}: the linear result is off by {:.1} % of the largest displacement, {:.1} % are tolerated.",
            if deflection.droops {
                "Droops, the large-deflection solution is the valid one"
            } else {
                "Linear is valid"
            },
            1e2 * linear_error,
            1e2 * tolerance
        )?;
        if let Some(factor) = deflection.limit_factor {
            writeln!(out, "Linear holds up to {factor:.3} times this load (force and weight together).")?;
        }

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
                "To do it alone the active layer would need {:.1} GPa at {highest_v} V: the voltage acts on the coupling.",
                1e-9 * pascal
            )?,
            None => writeln!(out, "No stiffness of the active layer alone gives what {highest_v} V do.")?,
        }
        writeln!(out, "\n  force | voltage | measured |   slip | off by | report's FEM | off by | bonded")?;
        writeln!(out, "   [uN] |     [V] |     [mm] |   [mm] |    [%] |         [mm] |    [%] |   [mm]")?;
        for tip in &layers.identified.tips {
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
        let Layers { voltage_v, interlayer_pa_per_m, tip_mm, bonded_mm, sliding_mm, .. } = layers;
        writeln!(
            out,
            "Under the force above, {voltage_v} V, {interlayer_pa_per_m:.3e} Pa/m: {tip_mm:.3} mm ({bonded_mm:.3} bonded, \
             {sliding_mm:.3} sliding), small deflections."
        )
    }

    /// Name and content of the figures.
    pub fn figures(&self, readings: &[Reading]) -> Vec<(&'static str, String)> {
        let measured = |reading: &Reading| (reading.displacement_mm, reading.force_un);
        let mut experiment = Figure::new("Beam experiment", "displacement [mm]", "force [uN]")
            .points("readings", readings.iter().map(measured));
        let far = readings.iter().map(|reading| reading.displacement_mm).fold(0.0, f64::max);
        for line in &self.experiment.lines {
            let name = format!("{} V: {:.1} uN/mm", line.voltage_v, line.un_per_mm.value);
            experiment = experiment.curve(&name, [(0.0, 0.0), (far, line.un_per_mm.value * far)], false);
        }
        let shape = &self.deflection.shape;
        let beam = Figure::new("Beam under load", "distance from the clamp [mm]", "displacement [mm]")
            .curve("large deflection", shape.iter().map(|[_, _, x, y]| (*x, *y)), false)
            .curve("linear", shape.iter().map(|[x, y, _, _]| (*x, *y)), true);
        let mut stack = Figure::new("Stack under load", "distance from the clamp [mm]", "displacement [mm]");
        for (name, shape) in &self.layers.shapes {
            stack = stack.curve(name, shape.iter().copied(), *name != "with slip");
        }
        vec![("experiment.svg", experiment.svg()), ("beam.svg", beam.svg()), ("stack.svg", stack.svg())]
    }
}

fn plus_minus(interval: &Interval, decimals: usize) -> String {
    format!("{:.decimals$} +- {:.decimals$}", interval.value, interval.high - interval.value)
}

fn span(interval: &Interval) -> String {
    format!("{:.3e} ({:.3e} to {:.3e})", interval.value, interval.low, interval.high)
}

/// Elements unless another number is asked for.
pub const ELEMENTS: usize = layered::ELEMENTS;
