//! A target through the controller.

use anyhow::Result;
use model::{Amplifier, Approach, Compensation, Gains, Margin};
use paper::stair::request::{Answer, Request, Target};
use serde::{Deserialize, Serialize};
use simulation::bad_input;
use simulation::has_reference::remark_on_fall_back;
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
    /// `none`, `paper`, `fast` or `robust`.
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
    /// How well the robust controller knows the spring; absent for 5 % in share and time constants.
    #[serde(default)]
    pub known: Option<Known>,
    /// Ticks per second, in Hz.
    pub rate_hz: f64,
}

/// Errors to within which the robust controller knows the spring, and what a step may overshoot and fall back, in percent.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Known {
    /// Error of all time constants.
    pub tau: f64,
    /// Error of the share.
    pub share: f64,
    /// Error of the gain.
    pub gain: f64,
    /// Overshoot of a step.
    pub overshoot: f64,
    /// Part of a step by which all springs may fall back for a while.
    #[serde(default)]
    pub fall_back: f64,
}

impl Known {
    fn margin(self) -> Margin {
        let Self { tau, share, gain, overshoot, fall_back } = self;
        Margin {
            time_constant: tau / 100.0,
            share: share / 100.0,
            gain: gain / 100.0,
            overshoot: overshoot / 100.0,
            fall_back: fall_back / 100.0,
        }
    }
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
    let mut remarks = Vec::new();
    if !left_out.is_empty() {
        remarks.push(format!("not simulated: {}", left_out.join(", ")));
    }
    if let Compensation::Robust(margin) = &experiment.settings.compensation {
        remarks.extend(remark_on_fall_back(plant.extended(), margin));
    }
    let amplifier = &experiment.settings.amplifier;
    Ok(Shown {
        json: serde_json::to_string(report)?,
        remarks,
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
            "robust" => Compensation::Robust(control.known.map_or(Margin::TYPICAL, Known::margin)),
            other => bad_input!("controller {other}: expected none, paper, fast or robust"),
        },
        controlled: control.controller != "none",
        amplifier: Amplifier { slew_v_per_s: control.slew_v_per_s, ..Amplifier::up_to(control.limit_v) },
        rate_hz: control.rate_hz,
    };
    request.check().map_err(|error| named(error, SETTINGS))?;
    request.run(|_, _| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(request: &str) -> Result<Shown> {
        run(&serde_json::from_str(request).expect("a request"))
    }

    /// The request of the page for the robust controller, and what `vsj stair` runs for it.
    #[test]
    fn the_robust_controller_is_that_of_the_command_to_the_bit() {
        let request = r#"{"plant":"paper","target":"step","controller":"robust","limit_v":1000,"slew_v_per_s":null,"kp":4,"ki":1.35,
            "approach_s":0,"known":{"tau":7,"share":3,"gain":1,"overshoot":2,"fall_back":20},"rate_hz":500}"#;
        let margin = Margin { time_constant: 0.07, share: 0.03, gain: 0.01, overshoot: 0.02, fall_back: 0.2 };
        let plant = spring("paper").expect("the report's spring");
        let settings = Request {
            plant: &plant,
            paper: true,
            target: Target::Step,
            compensation: Compensation::Robust(margin),
            controlled: true,
            amplifier: Amplifier::up_to(1000.0),
            rate_hz: 500.0,
        };
        let expected = settings.run(|_, _| ()).expect("a run");
        assert_eq!(of(request).expect("a run").json, serde_json::to_string(&expected.report).expect("JSON"));
        let control = serde_json::from_str(request).expect("a request");
        let codes = |answer: &Answer| answer.run.with.iter().map(|sample| sample.code).collect::<Vec<_>>();
        assert!(codes(&answer(&control, &plant).expect("a run")) == codes(&expected));
        let fast = Control { controller: "fast".to_owned(), ..control };
        assert!(codes(&answer(&fast, &plant).expect("a run")) != codes(&expected));
        let inert = of(&request.replace("\"share\":3", "\"share\":9")).expect("a run").remarks;
        assert!(inert.len() == 1 && inert[0].starts_with("a fall back by 20 % has no effect"), "{inert:?}");
        let error = of(&request.replace("\"tau\":7", "\"tau\":70")).expect_err("out of range").to_string();
        assert!(error.starts_with("--known: margin.time_constant = 0.7 is not allowed: "), "{error}");
    }
}
