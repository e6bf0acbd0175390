//! All controllers on the same steps, compared with the lower bound for any controller.

use anyhow::Result;
use model::{Amplifier, Approach, Compensation, ExtendedPlant, Gains, Settings};
use serde::Serialize;

use crate::experiment::{Experiment, HasReference, StartsFrom, with_plant};
use crate::plant_file::PlantFile;
use crate::response::Response;
use crate::response::responses;
use crate::schedule::Schedule;

/// The answer of `vsj compare --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Initial state of the spring for each `bound_t97_s`.
    pub bound_from: StartsFrom,
    /// One entry per amplifier.
    pub limits: Vec<AtLimit>,
}

/// The responses behind one amplifier.
#[derive(Clone, Debug, Serialize)]
pub struct AtLimit {
    /// Highest voltage of the amplifier, in V.
    pub limit_v: f64,
    /// One entry per change of the target.
    pub steps: Vec<Step>,
}

/// The responses to one change of the target.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// Without a controller: the target is the voltage.
    pub none: Response,
    /// With the report's proportional-integral controller.
    pub paper: Response,
    /// With the time-optimal controller.
    pub fast: Response,
}

impl Step {
    /// The responses with the names of their controllers.
    pub fn each(&self) -> [(&'static str, &Response); 3] {
        [("none", &self.none), ("paper", &self.paper), ("fast", &self.fast)]
    }
}

/// Runs the stair of ideal steps on a spring behind each of the amplifiers.
///
/// # Errors
/// [`crate::bad_input::BadInput`] for settings that the controller rejects.
pub fn compare(file: &PlantFile, rate_hz: f64, amplifiers: &[Amplifier]) -> Result<Comparison> {
    let settings = |amplifier| Settings {
        rate_hz,
        plant: file.extended(),
        compensation: Compensation::None,
        amplifier: file.behind(amplifier),
        feedback: None,
    };
    let limits = amplifiers.iter().map(|&amplifier| {
        let settings = settings(amplifier);
        // As in `vsj stair`: where the range ends below the limit, only the sampled reference accepts targets at its
        // end.
        let steps = match settings.plant.plain().filter(|_| settings.amplifier.max_v == amplifier.max_v) {
            Some(plant) => steps(with_plant(&settings, plant))?,
            None => steps(settings)?,
        };
        Ok(AtLimit { limit_v: settings.amplifier.max_v, steps })
    });
    let bound_from = ExtendedPlant::bounds_from(&settings(Amplifier::PAPER));
    Ok(Comparison { bound_from, limits: limits.collect::<Result<_>>()? })
}

fn steps<P: HasReference>(settings: Settings<P>) -> Result<Vec<Step>> {
    let of = |compensation| {
        let settings = Settings { compensation, ..settings };
        let experiment =
            Experiment { name: "the stair of ideal steps".to_owned(), schedule: Schedule::ideal_stair(), settings };
        let run = experiment.run(|_, _| ())?;
        Ok::<_, anyhow::Error>((responses(&experiment, &run, &run.with), responses(&experiment, &run, &run.without)))
    };
    let (paper, none) = of(Compensation::ProportionalIntegral(Gains::PAPER))?;
    let (fast, _) = of(Compensation::TimeOptimal(Approach::DEAD_BEAT))?;
    let together = none.into_iter().zip(paper).zip(fast);
    Ok(together.map(|((none, paper), fast)| Step { none, paper, fast }).collect())
}
