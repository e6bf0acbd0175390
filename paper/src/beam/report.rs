//! The answer of `vsj beam`: data for JSON, text and figures.

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

/// Inputs of `vsj beam`.
pub struct Setup {
    /// Readings of the beam experiment.
    pub readings: Vec<Reading>,
    /// Tip displacements measured separately from `readings`, for checking the model.
    pub tips: Vec<Tip>,
    /// The stack of layers at 0 V.
    pub stack: Stack,
    /// The beam of one material.
    pub beam: Beam,
    /// Load of the beam; its tip force also bends the stack.
    pub load: Load,
    /// Tolerated error of the linear theory, as a part of the largest displacement, 0.0001 to 1.
    pub tolerance: f64,
    /// Places along the beam at which displacements are printed, in m from the clamp.
    pub at_m: Vec<f64>,
    /// Voltage across the stack, in V, 0 to 1000.
    pub voltage_v: f64,
    /// Interlayer stiffness, in Pa/m; `None` takes the identified one.
    pub interlayer_pa_per_m: Option<f64>,
    /// Number of finite elements along the stack.
    pub elements: usize,
}

/// The answer of `vsj beam --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Results of the beam experiment, with Young's modulus over the voltage.
    pub experiment: Experiment,
    /// Deflection of the beam of one material under its load.
    pub deflection: Statics,
    /// Deflection of the stack of layers.
    pub layers: Layers,
}

/// Deflection of the beam of one material.
#[derive(Clone, Debug, Serialize)]
pub struct Statics {
    /// Largest difference between linear and exact displacement, as a part of the largest exact displacement.
    pub linear_error: f64,
    /// Tolerated `linear_error`.
    pub tolerance: f64,
    /// True if `linear_error` exceeds `tolerance`: the large-deflection result is the valid one.
    pub droops: bool,
    /// Factor on this load up to which the linear theory is valid; `None` without a load.
    pub limit_factor: Option<f64>,
    /// Displacements at the places asked for.
    pub places: Vec<Place>,
    #[serde(skip)]
    shape: Vec<[f64; 4]>,
}

/// Deflection of the stack of layers.
#[derive(Clone, Debug, Serialize)]
pub struct Layers {
    /// Interlayer stiffness identified from the experiment.
    pub identified: Identified,
    /// Spring constant of bonded layers divided by the measured one, at 0 V.
    pub bonded_by_measured: f64,
    /// Voltage across the stack, in V.
    pub voltage_v: f64,
    /// Interlayer stiffness used, in Pa/m.
    pub interlayer_pa_per_m: f64,
    /// Tip displacement under the given force, in mm.
    pub tip_mm: f64,
    /// Tip displacement with bonded layers, in mm.
    pub bonded_mm: f64,
    /// Tip displacement with layers that slide freely, in mm.
    pub sliding_mm: f64,
    /// Names and points, in mm, of the bent shapes for the figure.
    #[serde(skip)]
    shapes: Vec<(&'static str, Vec<(f64, f64)>)>,
}

impl Report {
    /// Computes the answer.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the input that is out of range.
    pub fn new(setup: &Setup) -> Result<Self> {
        let Setup { readings, tips, stack, beam, load, tolerance, at_m, voltage_v, interlayer_pa_per_m, elements } =
            setup;
        check("voltage_v", *voltage_v, 0.0..=1000.0, "V")?;
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
        let stiffened = stack.with_modulus(ACTIVE, active_modulus_pa(*voltage_v)?)?;
        let bend = |interlayer: f64| bend(&stiffened, interlayer, load.tip_n, *elements);
        // Before the search of the identification, so that an input out of range is refused without it.
        let given = interlayer_pa_per_m.map(bend).transpose()?;
        let identified = Identified::new(stack, &experiment, tips)?;
        let interlayer = interlayer_pa_per_m.unwrap_or_else(|| identified.interlayer_pa_per_m(*voltage_v));
        let bent = given.map_or_else(|| bend(interlayer), Ok)?;
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

    /// The figures, each with its file name.
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
