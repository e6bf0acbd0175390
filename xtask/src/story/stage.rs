//! What every story needs: the image, the spring to hide effects in, and a way up and down.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use firmware::RATE_HZ;
use firmware::rehearsal::rehearse;
use firmware::script::{Script, UP_DOWN_TICKS, up_down_v};
use link::WireModel;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use validation::ground_truth::live::Live;
use validation::ground_truth::{Cause, Effect, Noise, Schedule};

use super::lock_step::{self, Moment};
use crate::emulate::Comparison;
use crate::image::{self, Board, Opt};
use crate::variant::Controller;

/// Ticks between two rows of a record.
pub(super) const EVERY: usize = 50;
/// White noise on the readings, in percent of 500 V.
const NOISE_PERCENT: f64 = 0.2;
/// The part of each step that counts as settled, in ticks before its end.
const SETTLED: usize = 2 * RATE_HZ as usize;

/// True stiffness less target, in V.
#[derive(Clone, Copy, Serialize)]
pub(super) struct Errors {
    /// Root mean square over the run.
    pub(super) rms_v: f64,
    /// The largest mean of the settled part of a step, without its sign.
    pub(super) worst_plateau_v: f64,
}

impl Errors {
    pub(super) fn of(moments: &[Moment]) -> Self {
        let errors: Vec<f64> = (0..).zip(moments).map(|(tick, m)| m.stiffness_v - f64::from(up_down_v(tick))).collect();
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let squares: Vec<f64> = errors.iter().map(|error| error * error).collect();
        // Each step lasts 10 s, from 5 s on.
        let steps = 5_000..=errors.len();
        let ends = steps.step_by(10_000).map(|end| mean(&errors[end - SETTLED..end]).abs());
        Self { rms_v: mean(&squares).sqrt(), worst_plateau_v: ends.fold(0.0, f64::max) }
    }
}

/// One way up and down.
pub(super) struct Way {
    /// Tick by tick.
    pub(super) moments: Vec<Moment>,
    /// What the board's log said of its sensor.
    pub(super) sensor: Vec<String>,
    /// In a tick of the model.
    pub(super) most_instructions: u32,
}

/// The image, and where it is played.
pub(super) struct Stage {
    /// Name of the way up and down on the model alone.
    pub(super) run: &'static str,
    pub(super) elf: PathBuf,
    folder: PathBuf,
    /// The paper's spring on the way up and down: the schedule that the effects' sizes are drawn for, and its stiffness.
    schedule: Schedule,
    top_v: f64,
}

impl Stage {
    /// With these features of the firmware, beside those that the controller needs.
    pub(super) fn new(controller: Controller, features: &[&str]) -> Result<Self> {
        let run = match controller {
            Controller::Paper => "up-down",
            Controller::Fast => "up-down fast",
        };
        let features = [&["story"], controller.features(), features].concat();
        let elf = image::build_with(&features[1..], Board::Mps2, Opt::S)?;
        let (mut rows, mut top_v, mut tick) = (Vec::new(), 0f64, 0);
        rehearse(Script::parse(run).context("no such run")?, |_, done| {
            if tick % EVERY == 0 {
                rows.push((tick as f64 / f64::from(RATE_HZ), done.output.applied.to_f64()));
            }
            top_v = top_v.max(done.output.stiffness.to_f64());
            tick += 1;
        })?;
        let (time_s, voltage_v) = rows.into_iter().unzip();
        let folder = image::target_directory()?.join(features.join("-"));
        Ok(Self { run, elf, folder, schedule: Schedule { time_s, voltage_v }, top_v })
    }

    /// An empty folder for the board's files, no model in its flash.
    pub(super) fn folder(&self, cause: Option<Cause>) -> Result<PathBuf> {
        let folder = self.folder.join(name(cause));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        fs::write(folder.join("model.flash"), vec![0xff; 2 * firmware::store::PAGE])?;
        Ok(folder)
    }

    /// The spring that hides `cause`, its size and its sensor's noise from `seed`.
    pub(super) fn spring(&self, cause: Option<Cause>, seed: u64) -> Live {
        let noise = Noise::white(NOISE_PERCENT);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let draw = |cause| Effect::draw(&mut random, cause, 0, &self.schedule, noise.sigma_v);
        let effects: Vec<Effect> = cause.map(draw).into_iter().collect();
        Live::new(&effects, noise, seed, self.top_v, UP_DOWN_TICKS as usize)
    }

    /// One way up and down on the board, held against this machine.
    pub(super) fn lead(
        &self,
        run: &str,
        folder: &Path,
        spring: Live,
        silent: Range<usize>,
        found: Option<&WireModel>,
    ) -> Result<Way> {
        let (played, moments) = lock_step::run(&self.elf, run, folder, spring, silent)?;
        ensure!(moments.len() == UP_DOWN_TICKS as usize, "{} ticks at the spring", moments.len());
        // A tick hears what was read after the one before.
        let heard = |tick: u32| moments.get(tick.checked_sub(1)? as usize)?.heard;
        let comparison = Comparison::with(run, found, heard, &played)?;
        comparison.check()?;
        let said = played.log.iter().filter_map(|line| line.message.strip_prefix("sensor "));
        let sensor = said.map(str::to_owned).collect();
        let [.., most_instructions] = comparison.instructions;
        Ok(Way { moments, sensor, most_instructions })
    }
}

/// Of what is hidden.
pub(super) fn name(effect: Option<Cause>) -> &'static str {
    effect.map_or("none", |cause| cause.name())
}
