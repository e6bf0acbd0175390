//! What `vsj beam` finds out, as JSON and figures; `text` puts it in words.

use anyhow::Result;
use serde::Serialize;

use crate::beam::cantilever::{Beam, Load};
use crate::beam::droop::{Deflection, Place, limit};
use crate::beam::experiment::Experiment;
use crate::beam::layered::{BONDED_PA_PER_M, Bent, bend};
use crate::beam::limits::{bonded_n_per_m, sliding_n_per_m};
use crate::beam::readings::Reading;
use crate::beam::slip::{Identified, Tip};
use crate::beam::stack::{ACTIVE, Stack, active_modulus_pa};
use crate::figure::Figure;
use simulation::bad_input::check;

/// What is asked.
pub struct Question {
    /// Readings of the beam experiment.
    pub readings: Vec<Reading>,
    /// Displacements that were measured apart from them.
    pub tips: Vec<Tip>,
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
    /// [`simulation::bad_input::BadInput`] that names what cannot be.
    pub fn new(question: &Question) -> Result<Self> {
        let Question { readings, tips, stack, beam, load, tolerance, at_m, voltage_v, interlayer_pa_per_m, elements } =
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
        let identified = Identified::new(stack, &experiment, tips)?;
        check("voltage_v", *voltage_v, 0.0..=1000.0, "V")?;
        let interlayer = interlayer_pa_per_m.unwrap_or_else(|| identified.interlayer_pa_per_m(*voltage_v));
        let stiffened = stack.with_modulus(ACTIVE, active_modulus_pa(*voltage_v)?)?;
        let bend = |interlayer: f64| bend(&stiffened, interlayer, load.tip_n, *elements);
        let bent = bend(interlayer)?;
        let shape = |bent: &Bent| bent.nodes.iter().map(|&(x, w)| (1e3 * x, 1e3 * w)).collect();
        let shapes = vec![
            ("with slip", shape(&bent)),
            ("bonded", shape(&bend(BONDED_PA_PER_M)?)),
            ("sliding", shape(&bend(0.0)?)),
        ];
        let mm = |n_per_m: f64| 1e3 * load.tip_n / n_per_m;
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

    /// The figures, each with the name of its file.
    pub fn figures(&self, readings: &[Reading]) -> Vec<(&'static str, Figure)> {
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
        vec![("experiment.svg", experiment), ("beam.svg", beam), ("stack.svg", stack)]
    }
}
