//! The answer of `vsj dynamics`: the response, and the equivalent parameters of the other models.

use anyhow::Result;
use model::Plant;
use serde::Serialize;

use crate::beam::experiment::Experiment;
use crate::dynamics::analogue::{self, largest_difference};
use crate::dynamics::input::Input;
use crate::dynamics::mapping::{plant_of, stand_in_error, stand_in_limit};
use crate::dynamics::plant::PlantGains;
use crate::dynamics::spring_damper::SpringDamper;
use crate::dynamics::zener::{Changes, Sample, Start, Zener};
use crate::figure::Figure;

/// The dynamic models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Spring in series with a parallel spring and damper.
    Zener,
    /// Parallel spring and damper alone.
    SpringDamper,
    /// The electrical analogue of the Zener model, solved as a circuit.
    Analogue,
    /// The report's proportional-integral plant, its input the level as a voltage.
    PiPlant,
}

impl Model {
    /// Name of the model in titles and legends.
    pub fn name(self) -> &'static str {
        match self {
            Self::Zener => "Zener model",
            Self::SpringDamper => "spring and damper",
            Self::Analogue => "electrical analogue",
            Self::PiPlant => "proportional-integral plant",
        }
    }
}

/// Inputs of `vsj dynamics`.
pub struct Setup {
    /// The model to run.
    pub model: Model,
    /// Springs, damper and force of the mechanical models.
    pub zener: Zener,
    /// Relaxed length of the spring-damper model, in m.
    pub length_m: f64,
    /// Gains of the proportional-integral plant.
    pub gains: PlantGains,
    /// The level over time.
    pub input: Input,
    /// Initial state.
    pub start: Start,
    /// Time between two rows, in s.
    pub every_s: f64,
}

/// The answer of `vsj dynamics --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The model that ran.
    pub model: Model,
    /// Name of the input.
    pub input: String,
    /// The response.
    pub rows: Vec<Sample>,
    /// The plant equivalent to the Zener model under a changing force.
    pub plant: PlantGains,
    /// Instantaneous share of that plant, 0 to 1.
    pub share: f64,
    /// Time constant of that plant, in s.
    pub tau_s: f64,
    /// The Zener model equivalent to the given plant, its springs at level 1.
    pub zener_of_plant: Zener,
    /// Accuracy of the plant as an approximation of a Zener model whose springs change.
    pub stand_in: StandIn,
    /// Largest difference between the Zener model and its circuit over this input, as a part of the largest elongation;
    /// `None` if neither of the two ran.
    pub analogue_difference: Option<f64>,
    #[serde(skip)]
    curves: Vec<(&'static str, Vec<Sample>)>,
}

/// Accuracy of the plant as an approximation when both springs change by the same ratio under a constant force.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct StandIn {
    /// Largest ratio, up to 100, at which the plant's error is at most 1 % of the change.
    pub ratio_at_1_percent: f64,
    /// Largest ratio, up to 100, at which the plant's error is at most 5 % of the change.
    pub ratio_at_5_percent: f64,
    /// Stiffness ratio of this material between the highest measured voltage and 0 V.
    pub material_ratio: f64,
    /// The plant's error at `material_ratio` upwards, in percent of the change.
    pub material_up_percent: f64,
    /// The plant's error at `material_ratio` downwards, in percent of the change.
    pub material_down_percent: f64,
}

impl Report {
    /// Runs the model and computes the equivalent parameters.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the input that is out of range.
    pub fn new(setup: &Setup) -> Result<Self> {
        let zener = setup.zener.checked()?;
        let plant = plant_of(&zener);
        let Plant { share, time_constant_s: tau_s } = plant.plant();
        let zener_of_plant = setup.gains.zener(zener.k2_n_per_m, zener.force_n)?;
        let rows = run(setup, setup.model, setup.every_s)?;
        // Dense enough for a smooth curve, however long the input.
        let curve_every_s = setup.every_s.min(f64::max(0.5, 1e-5 * setup.input.duration_s()));
        let curve = |model: Model| Ok::<_, anyhow::Error>((model.name(), run(setup, model, curve_every_s)?));
        let mut curves = vec![curve(setup.model)?];
        match setup.model {
            Model::Zener => curves.push(curve(Model::Analogue)?),
            Model::Analogue => curves.push(curve(Model::Zener)?),
            Model::SpringDamper | Model::PiPlant => {}
        }
        let analogue_difference = match &curves[..] {
            [(_, one), (_, other)] => Some(largest_difference(one, other)),
            _ => None,
        };
        Ok(Self {
            model: setup.model,
            input: setup.input.name.clone(),
            rows,
            plant,
            share,
            tau_s,
            zener_of_plant,
            stand_in: stand_in(&zener_of_plant)?,
            analogue_difference,
            curves,
        })
    }

    /// The response and the level over time.
    pub fn figure(&self) -> Figure {
        let (title, label) = match self.model {
            Model::PiPlant => ("Proportional-integral plant", "output [V]"),
            _ => ("Response to the level", "stiffness seen, F / e [N/m]"),
        };
        let mut figure = Figure::new(title, "time [s]", label);
        for (index, (name, samples)) in self.curves.iter().enumerate() {
            let finite = samples.iter().filter(|sample| sample.stiffness.is_finite());
            figure = figure.curve(name, finite.map(|sample| (sample.time_s, sample.stiffness)), index > 0);
        }
        let level = self.curves[0].1.iter().map(|sample| (sample.time_s, sample.level));
        figure.curve("level", level, true)
    }
}

/// Runs one model; samples are `every_s` seconds apart.
fn run(setup: &Setup, model: Model, every_s: f64) -> Result<Vec<Sample>> {
    let Setup { zener, length_m, gains, input, start, .. } = setup;
    match model {
        Model::Zener => zener.response(input, *start, every_s),
        Model::Analogue => analogue::response(zener, input, *start, every_s),
        Model::SpringDamper => {
            let Zener { k2_n_per_m, damper_n_s_per_m, force_n, .. } = *zener;
            SpringDamper { k_n_per_m: k2_n_per_m, damper_n_s_per_m, length_m: *length_m, force_n }
                .response(input, *start, every_s)
        }
        Model::PiPlant => gains.response(input, *start, every_s),
    }
}

fn stand_in(zener: &Zener) -> Result<StandIn> {
    let material_ratio = Experiment::paper()?.reach_ratio.value;
    let zener = Zener { changes: Changes::Both, ..*zener };
    Ok(StandIn {
        ratio_at_1_percent: stand_in_limit(&zener, 0.01)?,
        ratio_at_5_percent: stand_in_limit(&zener, 0.05)?,
        material_ratio,
        material_up_percent: 1e2 * stand_in_error(&zener, material_ratio)?,
        material_down_percent: 1e2 * stand_in_error(&zener, material_ratio.recip())?,
    })
}
