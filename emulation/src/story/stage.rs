//! What both demonstrations need: the image, a spring that hides an effect, and one pass up and down the stair.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use firmware::RATE_HZ;
use firmware::control::{Control, Tick};
use link::WireModel;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use test_bench::script::{Script, UP_DOWN_TICKS, up_down_v};
use test_bench::simulation::simulate;
use validation::ground_truth::live::Live;
use validation::ground_truth::{Cause, Effect, Noise, Schedule};
use xtask::build::{self, Board, Opt};
use xtask::shell;
use xtask::variant::Controller;

use super::lock_step::{self, Disturbance, Moment};
use crate::qemu::comparison::Comparison;
use crate::qemu::emulator;

/// Ticks between two rows of a record.
pub(super) const EVERY: usize = 50;
/// Standard deviation of the white noise on the readings, in percent of 500 V.
const NOISE_PERCENT: f64 = 0.2;
/// Most lines of the log in an error.
const MOST_LINES: usize = 10;
/// Length of the settled part at the end of each step, in ticks.
const SETTLED: usize = 2 * RATE_HZ as usize;

/// Errors of the true stiffness relative to the target, in V.
#[derive(Clone, Copy, Serialize)]
pub(super) struct Errors {
    /// Root mean square over the run.
    pub(super) rms_v: f64,
    /// Largest absolute mean over the settled part of a step.
    pub(super) worst_plateau_v: f64,
}

impl Errors {
    /// Errors over a pass.
    pub(super) fn of(moments: &[Moment]) -> Self {
        let errors: Vec<f64> = (0..).zip(moments).map(|(tick, m)| m.stiffness_v - f64::from(up_down_v(tick))).collect();
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let squares: Vec<f64> = errors.iter().map(|error| error * error).collect();
        // Each step lasts 10 s, the first one 5 s.
        let steps = 5_000..=errors.len();
        let ends = steps.step_by(10_000).map(|end| mean(&errors[end - SETTLED..end]).abs());
        Self { rms_v: mean(&squares).sqrt(), worst_plateau_v: ends.fold(0.0, f64::max) }
    }
}

/// Result of one pass up and down.
pub(super) struct Pass {
    /// Every tick at the spring.
    pub(super) moments: Vec<Moment>,
    /// The board's log.
    pub(super) log: Vec<String>,
    /// Most instructions in a tick of the model.
    pub(super) most_instructions: u32,
}

impl Pass {
    /// The rest of each line of the log that begins with `word`.
    pub(super) fn said(&self, word: &str) -> Vec<String> {
        let rest = |line: &String| line.strip_prefix(word)?.strip_prefix(' ').map(str::to_owned);
        self.log.iter().filter_map(rest).collect()
    }
}

/// The image, and the folder that it runs in.
pub(super) struct Stage {
    /// Script of the pass without a sensor.
    pub(super) run: &'static str,
    /// Path of the image.
    pub(super) elf: PathBuf,
    folder: PathBuf,
    /// Voltage over time on the paper's spring, which the effects' sizes are drawn for, and its largest stiffness, in
    /// V.
    schedule: Schedule,
    top_v: f64,
}

impl Stage {
    /// Builds the image with further features of the package `firmware`.
    pub(super) fn new(controller: Controller, features: &[&str]) -> Result<Self> {
        let run = match controller {
            Controller::Paper => "up-down",
            Controller::Fast => "up-down fast",
            Controller::Robust => "up-down robust",
        };
        let features = [&["story"], controller.features(), features].concat();
        let elf = build::image_with(&features[1..], Board::Mps2, Opt::S)?;
        let (mut rows, mut top_v, mut tick) = (Vec::new(), 0f64, 0);
        simulate(Script::parse(run).context("no such run")?, |_, done| {
            if tick % EVERY == 0 {
                rows.push((tick as f64 / f64::from(RATE_HZ), done.output.applied.to_f64()));
            }
            top_v = top_v.max(done.output.stiffness.to_f64());
            tick += 1;
        })?;
        let (time_s, voltage_v) = rows.into_iter().unzip();
        let folder = shell::target_directory()?.join(features.join("-"));
        Ok(Self { run, elf, folder, schedule: Schedule { time_s, voltage_v }, top_v })
    }

    /// Makes an empty folder for the board's files, with no model in its flash.
    pub(super) fn folder(&self, name: &str) -> Result<PathBuf> {
        let folder = self.folder.join(name);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        fs::write(folder.join("model.flash"), vec![0xff; 2 * firmware::store::PAGE])?;
        Ok(folder)
    }

    /// A spring that hides `cause`. The effect's size and the sensor's noise are drawn with `seed`.
    pub(super) fn spring(&self, cause: Option<Cause>, seed: u64) -> Live {
        let noise = Noise::white(NOISE_PERCENT);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let draw = |cause| Effect::draw(&mut random, cause, 0, &self.schedule, noise.sigma_v);
        let effects: Vec<Effect> = cause.map(draw).into_iter().collect();
        Live::new(&effects, noise, seed, self.top_v, UP_DOWN_TICKS as usize)
    }

    /// Runs one pass on the board and compares it with the host. A difference is an error.
    pub(super) fn drive(
        &self,
        run: &str,
        folder: &Path,
        spring: Live,
        disturbance: &Disturbance,
        found: Option<&WireModel>,
    ) -> Result<Pass> {
        self.drive_with(run, folder, spring, disturbance, found, |_, _| ())
    }

    /// Runs one pass as [`Stage::drive`] does; on the host `each` is called after each tick.
    pub(super) fn drive_with(
        &self,
        run: &str,
        folder: &Path,
        spring: Live,
        disturbance: &Disturbance,
        found: Option<&WireModel>,
        each: impl FnMut(&mut Control, &Tick),
    ) -> Result<Pass> {
        let (played, moments) = lock_step::run(&self.elf, run, folder, spring, disturbance)?;
        // A board that was reset plays another script to its end: its log says why.
        ensure!(
            moments.len() == UP_DOWN_TICKS as usize,
            "{} ticks at the spring; the board says {:?}",
            moments.len(),
            played.log.iter().rev().take(MOST_LINES).rev().map(emulator::text).collect::<Vec<_>>()
        );
        // A tick receives the reading at the end of the one before.
        let received = |tick: u32| moments.get(tick.checked_sub(1)? as usize)?.received;
        let comparison = Comparison::after_each(run, found, received, &played, each)?;
        comparison.check()?;
        let log = played.log.into_iter().map(|line| line.message).collect();
        let [.., most_instructions] = comparison.instructions;
        Ok(Pass { moments, log, most_instructions })
    }
}

/// Name of the hidden effect.
pub(super) fn name(effect: Option<Cause>) -> &'static str {
    effect.map_or("none", |cause| cause.name())
}
