//! What `vsj dynamics` says: the response, and what the model is in terms of the others.

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

/// The models by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Spring in series with spring and damper
    Zener,
    /// The same without the series spring
    SpringDamper,
    /// The electrical analogue of the Zener model, solved as a circuit
    Analogue,
    /// The report's proportional-integral plant, driven by the level as a voltage
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

/// What is asked.
pub struct Question {
    /// The model.
    pub model: Model,
    /// Its springs, damper and force.
    pub zener: Zener,
    /// Relaxed length of the simplified model, in m.
    pub length_m: f64,
    /// Gains of the plant.
    pub gains: PlantGains,
    /// What drives it.
    pub input: Input,
    /// Where it starts.
    pub start: Start,
    /// Time between two rows, in s.
    pub every_s: f64,
}

/// The whole answer of `vsj dynamics --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The model that ran.
    pub model: Model,
    /// What drove it.
    pub input: String,
    /// The response.
    pub rows: Vec<Sample>,
    /// The plant that the Zener model is, under a changing force.
    pub plant: PlantGains,
    /// Its instantaneous share.
    pub share: f64,
    /// Its time constant, in s.
    pub tau_s: f64,
    /// The Zener model that is the plant asked for, springs at level 1.
    pub zener_of_plant: Zener,
    /// Where the plant stands in for a Zener model whose springs change.
    pub stand_in: StandIn,
    /// Largest difference between Zener model and circuit over this input, by the largest elongation, if one of them was asked for.
    pub analogue_difference: Option<f64>,
    #[serde(skip)]
    curves: Vec<(&'static str, Vec<Sample>)>,
}

/// How well the plant stands in when both springs change by one ratio under a constant force.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct StandIn {
    /// Largest ratio, up to 100, for which the plant is off by at most 1 % of the change.
    pub ratio_at_1_percent: f64,
    /// The same for 5 %.
    pub ratio_at_5_percent: f64,
    /// What this material does from no voltage to the highest one measured.
    pub material_ratio: f64,
    /// The plant's error there, upwards, in percent of the change.
    pub material_up_percent: f64,
    /// And downwards.
    pub material_down_percent: f64,
}

impl Report {
    /// Answers.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names what cannot be.
    pub fn new(question: &Question) -> Result<Self> {
        let zener = question.zener.checked()?;
        let plant = plant_of(&zener);
        let Plant { share, time_constant_s: tau_s } = plant.plant();
        let zener_of_plant = question.gains.zener(zener.k2_n_per_m, zener.force_n)?;
        let rows = run(question, question.model, question.every_s)?;
        // Close enough for the eye, however long the input.
        let curve_every_s = question.every_s.min(f64::max(0.5, 1e-5 * question.input.duration_s()));
        let curve = |model: Model| Ok::<_, anyhow::Error>((model.name(), run(question, model, curve_every_s)?));
        let mut curves = vec![curve(question.model)?];
        match question.model {
            Model::Zener => curves.push(curve(Model::Analogue)?),
            Model::Analogue => curves.push(curve(Model::Zener)?),
            Model::SpringDamper | Model::PiPlant => {}
        }
        let analogue_difference = match &curves[..] {
            [(_, one), (_, other)] => Some(largest_difference(one, other)),
            _ => None,
        };
        Ok(Self {
            model: question.model,
            input: question.input.name.clone(),
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

    /// The response over time, with the level.
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

/// Samples of one model.
fn run(question: &Question, model: Model, every_s: f64) -> Result<Vec<Sample>> {
    let Question { zener, length_m, gains, input, start, .. } = question;
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
