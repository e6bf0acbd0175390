//! What `vsj dynamics` says: the response, and what the model is in terms of the others.

use std::fmt::Write;

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
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
        let curve = |model: Model| Ok::<_, anyhow::Error>((name(model), run(question, model, curve_every_s)?));
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

    /// For the terminal.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "{} driven by {}", name(self.model), self.input)?;
        let unit = if self.model == Model::PiPlant { "  output [V]" } else { "stiffness [N/m]" };
        writeln!(out, "  time [s] |  level | elongation [m] | {unit}")?;
        for row in &self.rows {
            let elongation = row.elongation_m.map_or_else(|| "-".to_owned(), |m| format!("{m:.5}"));
            let stiffness = if row.stiffness.is_finite() { format!("{:.5}", row.stiffness) } else { "-".to_owned() };
            writeln!(out, "  {:8.2} | {:6.3} | {elongation:>14} | {stiffness:>12}", row.time_s, row.level)?;
        }
        let Self { plant, share, tau_s, zener_of_plant, stand_in, .. } = self;
        if matches!(self.model, Model::Zener | Model::Analogue) {
            writeln!(
                out,
                "Under a changing force this Zener model, at level 1, is exactly the plant with Kp = {:.4}, Ki = {:.4} 1/s: \
                 {:.2} % at once, the rest with {tau_s:.3} s.",
                plant.proportional,
                plant.integral_per_s,
                1e2 * share
            )?;
        }
        if self.model == Model::SpringDamper {
            writeln!(out, "Without the series spring nothing comes at once: no plant with Kp > 0 is this model.")?;
        }
        if let Some(difference) = self.analogue_difference {
            writeln!(
                out,
                "Zener model and circuit differ by at most {difference:.1e} of the largest elongation at any moment shown."
            )?;
        }
        let Zener { k1_n_per_m, k2_n_per_m, damper_n_s_per_m, .. } = zener_of_plant;
        writeln!(
            out,
            "The plant asked for is the Zener model with K1 = {k1_n_per_m:.4} N/m, K2 = {k2_n_per_m:.4} N/m, D = \
             {damper_n_s_per_m:.4} N s/m (K1 = K2 / Kp, D = tau K2)."
        )?;
        writeln!(
            out,
            "It stands in for that model, when both springs change under a constant force, within 1 % of the change up to a \
             ratio of {:.3}, within 5 % up to {:.3}. This material's {:.3} is off by {:.1} % upwards and {:.1} % downwards: \
             the model is faster where it is stiffer, the plant is not.",
            stand_in.ratio_at_1_percent,
            stand_in.ratio_at_5_percent,
            stand_in.material_ratio,
            stand_in.material_up_percent,
            stand_in.material_down_percent
        )
    }

    /// The response as CSV.
    pub fn csv(&self) -> String {
        let mut csv = format!("# {} driven by {}\ntime_s,level,elongation_m,stiffness\n", name(self.model), self.input);
        for row in &self.rows {
            let elongation = row.elongation_m.map(|m| format!("{m:.9}")).unwrap_or_default();
            let stiffness = if row.stiffness.is_finite() { format!("{:.9}", row.stiffness) } else { String::new() };
            let _ = writeln!(csv, "{:.6},{:.6},{elongation},{stiffness}", row.time_s, row.level);
        }
        csv
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

fn name(model: Model) -> &'static str {
    match model {
        Model::Zener => "Zener model",
        Model::SpringDamper => "spring and damper",
        Model::Analogue => "electrical analogue",
        Model::PiPlant => "proportional-integral plant",
    }
}
