//! Adaptation in closed loop: a spring changes, or its sensor fails, while the controller runs.
//!
//! [`adaptive`] is what the MCU runs. Here it drives the springs of [`crate::sampled`], in double precision, which share no code with
//! the tick, up and down in steps of 100 V. [`run`] measures each step after the change: with and without adaptation, and that of the
//! model alone, by a controller that has lost its sensor and has only the parameters of that moment.

pub mod adaptive;

use anyhow::Result;
use model::adaptation::{Parameters, Settings};
use model::isolation::{self, Verdict};
use model::{Config, Feedback, Input, Limits, OutOfRange, ScaledStiffness, Volts, controller};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

use crate::bad_input::BadInput;
use crate::bound::shortest_time;
use crate::plant_file::PlantFile;
use crate::reference::Loop;
use crate::response::measure;
use crate::run::{Run, Sample};
use crate::sampled::Spring;
use crate::schedule::Change;
use crate::spring_error::{DifferingSpring, SpringError};
use adaptive::{Adaptive, reading};

/// Levels of one round, in V. A step to 0 V, where the range ends, would take any controller longer than a level lasts.
const LEVELS_V: [f64; 8] = [100.0, 200.0, 300.0, 400.0, 500.0, 400.0, 300.0, 200.0];
/// Time for which each level is held, in s.
const HOLD_S: f64 = 10.0;
/// Number of levels before the one in which the change happens: a whole round.
const BEFORE: usize = LEVELS_V.len();
/// Time constants after which a spring that was at rest has settled.
const SETTLED_TAUS: f64 = 12.0;
/// Largest ratio of t97 to the shortest possible time of a step that counts as done in time.
pub const IN_TIME: f64 = 1.05;
/// Largest overshoot of such a step, in percent.
pub const MOST_OVERSHOOT_PERCENT: f64 = 2.0;

/// A fault of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SensorFault {
    /// The sensor repeats its last reading.
    Stuck,
    /// The sensor reads 20 V too much.
    Offset,
    /// The gain of the sensor grows by 0.1 % in a second.
    Drift,
    /// The noise of the sensor has four times its standard deviation.
    Noise,
}

/// What happens half of a level before the first of the measured steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Happens {
    /// The spring's parameters differ from the model's by this.
    pub spring_error: SpringError,
    /// The sensor fails.
    pub sensor_fault: Option<SensorFault>,
}

/// A step as one loop has made it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Made {
    /// Time to 97 % of the step, in s; `None` if the next step comes first.
    pub t97_s: Option<f64>,
    /// Largest overshoot, in percent of the step.
    pub overshoot_percent: f64,
    /// Whether t97 is at most [`IN_TIME`] times the shortest possible time, to one tick, and the overshoot at most
    /// [`MOST_OVERSHOOT_PERCENT`].
    pub in_time: bool,
}

/// One step after the change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Number after the change, from 1.
    pub number: usize,
    /// Target before it, in V.
    pub from_v: f64,
    /// Target after it, in V.
    pub to_v: f64,
    /// Shortest possible t97 of any controller on the changed spring, in s; `None` if out of reach.
    pub bound_t97_s: Option<f64>,
    /// With the stored model and the sensor.
    pub stored: Made,
    /// With adaptation and the sensor.
    pub adapted: Made,
    /// Without the sensor, with the parameters at the beginning of the step.
    pub alone: Made,
    /// Time constant of the running model at the beginning of the step, as a ratio to the stored one.
    pub time_constant: f64,
    /// Instantaneous share of the running model at the beginning of the step, as a ratio to the stored one.
    pub share: f64,
    /// Gain of the running model at the beginning of the step, as a ratio to the stored one.
    pub gain: f64,
    /// What the adaptation did at the end of the step.
    pub phase: &'static str,
}

/// The answer of `vsj adapt --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// Version of the JSON.
    pub schema: u32,
    /// What happened.
    #[serde(flatten)]
    pub happens: Happens,
    /// Standard deviation of the sensor's noise, in V.
    pub sensor_noise_v: f64,
    /// The steps after the change.
    pub steps: Vec<Step>,
    /// First step from which on all steps of the model alone are in time; `None` if the last one is not.
    pub alone_in_time_from: Option<usize>,
    /// Number of exchanges of the configuration.
    pub exchanges: u32,
    /// Largest deviation of a parameter from the stored model at any time, relative.
    pub largest_deviation: f64,
    /// What the bank says at the end.
    pub verdict: &'static str,
    /// Cause that it names at the end.
    pub cause: Option<&'static str>,
}

/// A question of `vsj adapt`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Question {
    /// The controller with its sensor; its plant is the stored model.
    pub control: controller::Settings,
    /// Bounds and conditions of the adaptation.
    pub adaptation: Settings,
    /// What happens.
    pub happens: Happens,
    /// Number of steps after it.
    pub steps: usize,
    /// Seed of the noise.
    pub seed: u64,
}

/// Returns the settings of a sensor of this noise, in V, that is read in each tick.
pub fn sensor(noise_v: f64, rate_hz: f64) -> Feedback {
    Feedback { noise_v, interval_s: 1.0 / rate_hz, ..Feedback::TYPICAL }
}

/// Returns the settings of the bank beside a controller with a sensor.
fn bank(control: &controller::Settings) -> isolation::Settings {
    let feedback = control.feedback.unwrap_or(Feedback::TYPICAL);
    isolation::Settings {
        plant: control.plant,
        noise_v: feedback.noise_v,
        interval_s: feedback.interval_s,
        range_v: control.amplifier.max_v,
        ..isolation::Settings::PAPER
    }
}

/// One run up and down the stair, with everything that the measurement needs.
struct Course {
    run: Run,
    /// Parameters at the beginning of each step.
    parameters: Vec<Parameters>,
    /// Phase at the end of each step.
    phases: Vec<&'static str>,
    exchanges: u32,
    largest_deviation: f64,
    verdict: Verdict,
}

fn target_v(step: usize) -> f64 {
    LEVELS_V[step % LEVELS_V.len()]
}

fn refused(error: OutOfRange) -> BadInput {
    BadInput(error.to_string())
}

fn sample(spring: &Spring, at: &crate::sampled::spring::State, gain: f64, applied: Volts) -> Sample {
    let reference = gain * spring.stiffness(at);
    Sample { code: model::DacCode(0), applied, stiffness: reading(reference), limits: Limits::NONE, reference }
}

impl Question {
    fn course(&self, adaptation: Option<Settings>) -> Result<Course> {
        let Self { control, happens, .. } = self;
        let sample_s = 1.0 / control.rate_hz;
        let bank = bank(control);
        let mut it = Adaptive::new(*control, bank, adaptation).map_err(refused)?;
        let file = PlantFile::from(control.plant);
        let [healthy, changed] =
            [SpringError::default(), happens.spring_error].map(|e| DifferingSpring::new(&file, &e));
        changed.check()?;
        let springs = [healthy, changed].map(|of| (of.spring(), of.gain));
        let mut at = springs[0].0.at_rest();
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let per_step = (HOLD_S * control.rate_hz) as usize;
        let change = BEFORE * per_step + per_step / 2;
        let mut course = Course {
            run: Run { start_s: 0.0, rate_hz: control.rate_hz, with: Vec::new(), without: Vec::new() },
            parameters: Vec::new(),
            phases: Vec::new(),
            exchanges: 0,
            largest_deviation: 0.0,
            verdict: Verdict::Quiet,
        };
        let mut last: Option<ScaledStiffness> = None;
        for tick in 0..(BEFORE + 1 + self.steps) * per_step {
            let (spring, gain) = &springs[usize::from(tick >= change)];
            if tick % per_step == 0 {
                course.parameters.push(it.adaptation().parameters());
            }
            let target = Volts::new(target_v(tick / per_step)).map_err(refused)?;
            let noise: f64 = StandardNormal.sample(&mut random);
            let read = (tick > 0).then(|| {
                let stiffness = gain * spring.stiffness(&at);
                let failed = happens.sensor_fault.filter(|_| tick >= change);
                let since_s = tick.saturating_sub(change) as f64 * sample_s;
                match (failed, last) {
                    (Some(SensorFault::Stuck), Some(last)) => last,
                    (Some(SensorFault::Offset), _) => reading(stiffness + 20.0 + bank.noise_v * noise),
                    (Some(SensorFault::Drift), _) => reading(stiffness * (1.0 + 1e-3 * since_s) + bank.noise_v * noise),
                    (Some(SensorFault::Noise), _) => reading(stiffness + 4.0 * bank.noise_v * noise),
                    _ => reading(stiffness + bank.noise_v * noise),
                }
            });
            last = read;
            let applied = it.tick(target, read).applied;
            spring.apply(&mut at, applied.to_f64());
            course.run.with.push(sample(spring, &at, *gain, applied));
            spring.hold(&mut at, sample_s);
            let Parameters { time_constant, share, gain } = it.adaptation().parameters();
            let away = [time_constant, share, gain].map(|ratio| (ratio - 1.0).abs()).into_iter().fold(0.0, f64::max);
            course.largest_deviation = course.largest_deviation.max(away);
            if (tick + 1) % per_step == 0 {
                course.phases.push(it.adaptation().phase().name());
            }
        }
        (course.exchanges, course.verdict) = (it.exchanges(), it.bank().verdict());
        Ok(course)
    }

    /// Step of a settled controller without its sensor, with these parameters, on the changed spring.
    fn alone(&self, parameters: &Parameters, step: usize, bound_s: Option<f64>) -> Result<Made> {
        let Self { control, happens, .. } = self;
        let plant = parameters.applied_to(control.plant);
        let settings = controller::Settings { plant, feedback: None, ..*control };
        let config: Config = settings.validate().map_err(refused)?.quantize();
        let changed = DifferingSpring::new(&PlantFile::from(control.plant), &happens.spring_error);
        let spring = changed.spring();
        let (mut at, mut state) = (spring.at_rest(), controller::State::default());
        let start_s = SETTLED_TAUS * control.plant.time_constant_s;
        let ticks = ((start_s + HOLD_S) * control.rate_hz) as usize;
        let start = (start_s * control.rate_hz) as usize;
        let mut run = Run { start_s: 0.0, rate_hz: control.rate_hz, with: Vec::new(), without: Vec::new() };
        for tick in 0..ticks {
            let level = target_v(if tick < start { step - 1 } else { step }) / parameters.gain;
            let target = Volts::new(level).map_err(refused)?;
            let applied = config.tick(&mut state, Input { target, ..Input::default() }).applied;
            spring.apply(&mut at, applied.to_f64());
            run.with.push(sample(&spring, &at, changed.gain, applied));
            spring.hold(&mut at, 1.0 / control.rate_hz);
        }
        let start_s = start as f64 / control.rate_hz;
        Ok(self.made(&run, step, start_s, start_s + HOLD_S, bound_s))
    }

    /// A step as a run has made it, from the spring's stiffness at its start.
    fn made(&self, run: &Run, step: usize, start_s: f64, end_s: f64, bound_s: Option<f64>) -> Made {
        let change = Change { start_s, end_s, from_v: target_v(step - 1), to_v: target_v(step) };
        let present = crate::response::from_present(run, &run.with, &change);
        let response = measure(run, &run.with, &present, bound_s);
        let in_time =
            response.t97_s.zip(bound_s).is_some_and(|(t97, bound)| t97 <= IN_TIME * bound + 1.0 / run.rate_hz);
        let overshoot_percent = response.overshoot_percent;
        Made {
            t97_s: response.t97_s,
            overshoot_percent,
            in_time: in_time && overshoot_percent <= MOST_OVERSHOOT_PERCENT,
        }
    }
}

/// Runs the controller with and without adaptation, and measures every step after the change.
///
/// # Errors
/// [`BadInput`] for settings that the controller rejects, and for a spring that cannot be.
pub fn run(question: &Question) -> Result<Answer> {
    let Question { control, adaptation, happens, .. } = question;
    let (stored, adapted) = (question.course(None)?, question.course(Some(*adaptation))?);
    let changed = happens.spring_error;
    let system = Loop {
        share: control.plant.share * (1.0 + changed.share),
        time_constant_s: control.plant.time_constant_s * (1.0 + changed.time_constant),
        gains: None,
        range_v: (control.amplifier.min_v, control.amplifier.max_v),
        slew_v_per_s: control.amplifier.slew_v_per_s.unwrap_or(f64::INFINITY),
    };
    let gain = 1.0 + changed.gain;
    let steps = (BEFORE + 1..BEFORE + 1 + question.steps).map(|step| {
        let (from_v, to_v) = (target_v(step - 1), target_v(step));
        let bound_t97_s = shortest_time(&system, from_v / gain, to_v / gain, 0.97);
        let start_s = step as f64 * HOLD_S;
        let of = |course: &Course| question.made(&course.run, step, start_s, start_s + HOLD_S, bound_t97_s);
        let parameters = adapted.parameters[step];
        let Parameters { time_constant, share, gain } = parameters;
        Ok(Step {
            number: step - BEFORE,
            from_v,
            to_v,
            bound_t97_s,
            stored: of(&stored),
            adapted: of(&adapted),
            alone: question.alone(&parameters, step, bound_t97_s)?,
            time_constant,
            share,
            gain,
            phase: adapted.phases[step],
        })
    });
    let steps: Vec<Step> = steps.collect::<Result<_>>()?;
    let late = steps.iter().rposition(|step| !step.alone.in_time).map_or(0, |last| last + 1);
    Ok(Answer {
        schema: 1,
        happens: *happens,
        sensor_noise_v: bank(control).noise_v,
        alone_in_time_from: steps.get(late).map(|step| step.number),
        steps,
        exchanges: adapted.exchanges,
        largest_deviation: adapted.largest_deviation,
        verdict: adapted.verdict.name(),
        cause: adapted.verdict.causes().0.map(isolation::Cause::name),
    })
}
