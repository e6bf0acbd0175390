//! All controllers on the same steps, compared with the lower bound for any controller.

use anyhow::Result;
use model::{Amplifier, Approach, Compensation, ExtendedPlant, Feedback, Gains, Margin, Settings};
use serde::Serialize;

use crate::bad_input::BadInput;
use crate::control_loop::{Controller, gains, lowered};
use crate::experiment::{Experiment, HasReference, Run, StartsFrom, with_plant};
use crate::has_reference::remark_on_fall_back;
use crate::plant_file::PlantFile;
use crate::response::{Response, from_present, measure, responses};
use crate::schedule::{Change, Schedule};
use crate::spring_error::{DifferingSpring, SpringError};

/// The spring and its sensor, where they differ from the controllers' model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actual {
    /// Relative errors of the spring's parameters.
    pub spring_error: SpringError,
    /// Standard deviation of the white noise on a stiffness sensor's readings, one in each tick, in V; `None` without a sensor.
    pub sensor_noise_v: Option<f64>,
}

/// The answer of `vsj compare --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Relative errors of the spring's parameters; `None` if the spring is the controllers' model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spring_error: Option<SpringError>,
    /// Standard deviation of the noise on a sensor's readings, in V; `None` without a sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor_noise_v: Option<f64>,
    /// Initial state of the spring for each `bound_t97_s`.
    pub bound_from: StartsFrom,
    /// One entry per amplifier.
    pub limits: Vec<AtLimit>,
    /// What the user should know about the gains of the report's controller, one line each.
    #[serde(skip)]
    pub remarks: Vec<String>,
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
    /// Response without a controller, where the target is the voltage.
    pub none: Response,
    /// Response with the report's proportional-integral controller, whose gains are lowered as far as a quick spring demands.
    pub paper: Response,
    /// Response with the time-optimal controller.
    pub fast: Response,
    /// Response with the robust controller; `None` if no margin was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robust: Option<Response>,
}

impl Step {
    /// The responses with the names of their controllers.
    pub fn each(&self) -> impl Iterator<Item = (&'static str, &Response)> {
        let always = [("none", &self.none), ("paper", &self.paper), ("fast", &self.fast)];
        always.into_iter().chain(self.robust.as_ref().map(|robust| ("robust", robust)))
    }
}

/// Runs the stair of ideal steps, in steps of [`PlantFile::stair_step_v`], behind each of the amplifiers, on the controllers' model of the spring or on an actual spring. There
/// each step is measured from the stiffness at its start. With a margin, the robust controller is among them.
///
/// # Errors
/// [`BadInput`] for settings that the controller rejects, and for a spring that cannot be.
pub fn compare(
    file: &PlantFile,
    rate_hz: f64,
    amplifiers: &[Amplifier],
    actual: Option<&Actual>,
    margin: Option<Margin>,
) -> Result<Comparison> {
    let differing = actual.map(|actual| DifferingSpring::new(file, &actual.spring_error));
    differing.iter().try_for_each(DifferingSpring::check)?;
    let sensor_noise_v = actual.and_then(|actual| actual.sensor_noise_v);
    let on = differing.as_ref().map(|spring| (spring, sensor_noise_v));
    let settings = |amplifier| Settings {
        rate_hz,
        plant: file.extended(),
        compensation: Compensation::None,
        amplifier: file.behind(amplifier),
        feedback: None,
    };
    let gains = gains([None; 2], Controller::Paper, file, rate_hz)?;
    let limits = amplifiers.iter().map(|&amplifier| {
        let settings = settings(amplifier);
        let stair = Schedule::ideal_stair_of(file.stair_step_v(amplifier));
        // As in `vsj stair`: where the range ends below the limit, only the sampled reference accepts targets at its
        // end.
        let steps = match settings.plant.plain().filter(|_| settings.amplifier.max_v == amplifier.max_v) {
            Some(plant) => steps(with_plant(&settings, plant), &stair, gains, on, margin)?,
            None => steps(settings, &stair, gains, on, margin)?,
        };
        Ok(AtLimit { limit_v: settings.amplifier.max_v, steps })
    });
    let bound_from = ExtendedPlant::bounds_from(&settings(Amplifier::PAPER));
    let limits = limits.collect::<Result<_>>()?;
    let mut remarks = lowered(&gains, [None; 2]);
    remarks.extend(margin.and_then(|margin| remark_on_fall_back(file.extended(), &margin)));
    Ok(Comparison {
        spring_error: actual.map(|actual| actual.spring_error),
        sensor_noise_v,
        bound_from,
        limits,
        remarks,
    })
}

/// A spring that differs from the model, and the noise of its sensor in V, if it has one.
type On<'a> = (&'a DifferingSpring, Option<f64>);

fn steps<P: HasReference>(
    settings: Settings<P>,
    stair: &Schedule,
    gains: Gains,
    on: Option<On>,
    margin: Option<Margin>,
) -> Result<Vec<Step>> {
    let of = |compensation| {
        let settings = Settings { compensation, ..settings };
        let experiment = Experiment { name: "the stair of ideal steps".to_owned(), schedule: stair.clone(), settings };
        Ok::<_, anyhow::Error>(match on {
            None => {
                let run = experiment.run(|_, _| ())?;
                (responses(&experiment, &run, &run.with), responses(&experiment, &run, &run.without))
            }
            Some((spring, sensor_noise_v)) => {
                let without = Experiment {
                    settings: Settings { compensation: Compensation::None, ..settings },
                    ..experiment.clone()
                };
                (on_spring(&experiment, (spring, sensor_noise_v))?, on_spring(&without, (spring, None))?)
            }
        })
    };
    let (paper, none) = of(Compensation::ProportionalIntegral(gains))?;
    let (fast, _) = of(Compensation::TimeOptimal(Approach::DEAD_BEAT))?;
    let mut robust = match margin {
        Some(margin) => of(Compensation::Robust(margin))?.0,
        None => Vec::new(),
    }
    .into_iter();
    let together = none.into_iter().zip(paper).zip(fast);
    Ok(together.map(|((none, paper), fast)| Step { none, paper, fast, robust: robust.next() }).collect())
}

/// Responses of the controller of an experiment on a spring that differs from its model.
fn on_spring<P: HasReference>(experiment: &Experiment<P>, (actual, sensor_noise_v): On) -> Result<Vec<Response>> {
    let Experiment { schedule, settings, .. } = experiment;
    let rate_hz = settings.rate_hz;
    let interval_s = 1.0 / rate_hz;
    let feedback = sensor_noise_v.map(|noise_v| Feedback { noise_v, interval_s, ..Feedback::TYPICAL });
    let settings = Settings { feedback, ..*settings };
    let config = settings.validate().map_err(BadInput::from)?.quantize();
    let with = actual.closed_loop(&config, &experiment.targets()?, interval_s, sensor_noise_v)?;
    let run = Run { start_s: schedule.start_s(), rate_hz, with, without: Vec::new() };
    let changes = schedule.changes();
    let moved: Vec<Change> = changes.iter().map(|change| from_present(&run, &run.with, change)).collect();
    // The bound is that of the spring without its gain.
    let less = |v: f64| v / actual.gain;
    let scaled: Vec<Change> =
        moved.iter().map(|of| Change { from_v: less(of.from_v), to_v: less(of.to_v), ..*of }).collect();
    let bounds = ExtendedPlant::bounds(&with_plant(&settings, actual.file.extended()), &run, &run.with, &scaled);
    let each = changes.iter().zip(&moved).zip(bounds).map(|((change, moved), bound)| {
        let (from_v, to_v) = (change.from_v, change.to_v);
        Response { from_v, to_v, ..measure(&run, &run.with, moved, bound) }
    });
    Ok(each.collect())
}
