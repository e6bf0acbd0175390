//! A target through the controller.

use anyhow::Result;
use model::{Amplifier, Approach, Compensation, Gains};
use paper::stair::request::{Answer, Request, Target};
use serde::{Deserialize, Serialize};
use simulation::bad_input;
use simulation::option_names::{SETTINGS, named};
use simulation::plant_file::{self, PlantFile};
use simulation::record::{MEASURED, Record};
use simulation::run::{Run, Sample};
use simulation::schedule::Between;

use crate::curve::Curve;

/// The loop and its target, by the names of the options of `vsj stair`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// `paper`, or the text of a plant file.
    pub plant: String,
    /// `stair`, `step`, or the text of a CSV file with the columns `time_s,voltage_v`.
    pub target: String,
    /// Whether the voltage between two rows of a CSV file is interpolated linearly instead of held.
    #[serde(default)]
    pub linear: bool,
    /// `none`, `paper` or `fast`.
    pub controller: String,
    /// Highest voltage of the amplifier, in V.
    pub limit_v: f64,
    /// Slew limit of the amplifier, in V/s; absent for none.
    pub slew_v_per_s: Option<f64>,
    /// Proportional gain.
    pub kp: f64,
    /// Integral gain, in 1/s.
    pub ki: f64,
    /// Time constant of the fast controller's approach to the target, in s.
    pub approach_s: f64,
    /// Ticks per second, in Hz.
    pub rate_hz: f64,
}

/// Largest number of ticks: a browser has less memory than the command.
const MOST_TICKS: f64 = 2e6;

/// A finished run with what is drawn of it. Curves are over the time in s.
#[derive(Debug, Serialize)]
pub struct Shown {
    /// The answer of `vsj stair --json`.
    json: String,
    /// What the user should know, one line each.
    remarks: Vec<String>,
    /// Target, in V.
    target: Curve,
    /// Stiffness with the controller, as the equivalent static voltage in V.
    with: Curve,
    /// Stiffness without it.
    without: Curve,
    /// Voltage across the spring in the loop that was asked for, in V.
    applied: Curve,
    /// Times of the changes whose responses the answer lists, in s: start, and start of the next.
    changes: Vec<[f64; 2]>,
    /// Ends of the amplifier's range, in V.
    range_v: [f64; 2],
}

/// Runs a target.
///
/// # Errors
/// [`simulation::BadInput`] for settings, springs and targets that `vsj stair` refuses.
pub fn run(control: &Control) -> Result<Shown> {
    let plant = spring(&control.plant)?;
    let answer = answer(control, &plant)?;
    let Answer { experiment, run, report } = &answer;
    let curve = |samples: &[Sample], value: fn(&Sample) -> f64| {
        Curve::new(samples.len(), |tick| run.time_s(tick), |tick| value(&samples[tick]))
    };
    let targets = experiment.schedule.at_ticks(run.rate_hz);
    let left_out = plant.left_out();
    let amplifier = &experiment.settings.amplifier;
    Ok(Shown {
        json: serde_json::to_string(report)?,
        remarks: if left_out.is_empty() { vec![] } else { vec![format!("not simulated: {}", left_out.join(", "))] },
        target: Curve::new(targets.len(), |tick| run.time_s(tick), |tick| targets[tick]),
        with: curve(&run.with, |sample| sample.stiffness.to_f64()),
        without: curve(&run.without, |sample| sample.stiffness.to_f64()),
        applied: curve(chosen(control, run), |sample| sample.applied.to_f64()),
        changes: experiment.schedule.changes().iter().map(|change| [change.start_s, change.end_s]).collect(),
        range_v: [amplifier.min_v, amplifier.max_v],
    })
}

/// The ticks of the loop that was asked for.
pub(crate) fn chosen<'a>(control: &Control, run: &'a Run) -> &'a [Sample] {
    if control.controller == "none" { &run.without } else { &run.with }
}

/// Reads the spring of a request: `paper`, or the text of a plant file.
///
/// # Errors
/// [`simulation::BadInput`] with line and column of the text.
pub(crate) fn spring(plant: &str) -> Result<PlantFile> {
    if plant == "paper" { plant_file::load(plant) } else { plant_file::parse("spring", plant) }
}

/// Runs a target on a spring.
pub(crate) fn answer(control: &Control, plant: &PlantFile) -> Result<Answer> {
    let record;
    let target = match control.target.as_str() {
        "stair" => Target::Stair,
        "step" => Target::Step,
        text => {
            record = Record::parse("target.csv", text, MEASURED)?;
            let ticks = (record.rows[record.rows.len() - 1].time_s - record.rows[0].time_s) * control.rate_hz;
            if ticks > MOST_TICKS {
                bad_input!(
                    "the target takes {ticks:.0} ticks; expected at most {MOST_TICKS} on the page (`vsj stair` runs more)"
                );
            }
            Target::Record(&record, if control.linear { Between::Linear } else { Between::Hold })
        }
    };
    let request = Request {
        plant,
        paper: control.plant == "paper",
        target,
        compensation: match control.controller.as_str() {
            "fast" => Compensation::TimeOptimal(Approach { time_constant_s: control.approach_s }),
            "none" | "paper" => {
                Compensation::ProportionalIntegral(Gains { proportional: control.kp, integral_per_s: control.ki })
            }
            other => bad_input!("controller {other}: expected none, paper or fast"),
        },
        controlled: control.controller != "none",
        amplifier: Amplifier { slew_v_per_s: control.slew_v_per_s, ..Amplifier::up_to(control.limit_v) },
        rate_hz: control.rate_hz,
    };
    request.check().map_err(|error| named(error, SETTINGS))?;
    request.run(|_, _| ())
}
