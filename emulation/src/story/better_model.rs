//! The demonstration with a better model: run, diagnose, send the extended model, run again.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use link::{BlockId, WireModel};
use model::Plant;
use serde::Serialize;
use serde_json::Value;
use simulation::plant_file;
use validation::ground_truth::{Block, Cause};
use xtask::variant::Controller;
use xtask::{build, shell};

use super::lock_step::{Disturbance, Moment, TICK_S};
use super::stage::{EVERY, Errors, Stage, name};
use crate::qemu::emulator;
use crate::talk;

/// Time from the beginning of a tick to its reading, in s: just before the voltage can change again.
const READ_S: f64 = 0.999 * TICK_S;

/// Result for one effect.
#[derive(Serialize)]
pub(super) struct Outcome {
    /// Name of the hidden effect.
    pub(super) effect: &'static str,
    /// Verdict of the diagnosis.
    pub(super) verdict: String,
    /// Causes that the diagnosis found.
    pub(super) named: Vec<String>,
    /// Whether the first cause is the hidden one.
    pub(super) right: bool,
    /// Errors with the paper's model.
    pub(super) before: Errors,
    /// Errors with the extended model; `None` if there was none to send.
    pub(super) after: Option<Errors>,
    /// Reason why there is no second run; empty if there is one.
    pub(super) remark: String,
    /// Duration on the host's clock, in s.
    pub(super) wall_s: f64,
}

/// The image and the program `vsj`.
pub(super) struct Demonstration {
    stage: Stage,
    vsj: PathBuf,
}

impl Demonstration {
    /// Builds both.
    pub(super) fn new(controller: Controller) -> Result<Self> {
        let stage = Stage::new(controller, &[])?;
        Ok(Self { stage, vsj: build::vsj()? })
    }

    /// Runs the demonstration for one effect, or for a spring without any.
    pub(super) fn run(&self, cause: Option<Cause>, seed: u64) -> Result<Outcome> {
        let begin = Instant::now();
        let folder = self.stage.folder(name(cause))?;
        let drive = |found: Option<&WireModel>| {
            let pass =
                self.stage.drive(self.stage.run, &folder, self.stage.spring(cause, seed), &Disturbance::None, found)?;
            anyhow::Ok(pass.moments)
        };
        let first = drive(None)?;
        let report = self.diagnose(&folder, &first)?;
        let named: Vec<String> = report["findings"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|finding| Some(finding["cause"].as_str()?.to_owned()))
            .collect();
        let model = self.model(&folder)?;
        let after = match &model {
            None => None,
            Some(model) => {
                self.send(&folder, model)?;
                Some(Errors::of(&drive(Some(model))?))
            }
        };
        let right = named.first().map(String::as_str) == cause.map(|cause| cause.name());
        Ok(Outcome {
            effect: name(cause),
            verdict: report["verdict"].as_str().unwrap_or_default().to_owned(),
            right,
            before: Errors::of(&first),
            after,
            remark: remark(cause, &named, model.is_some()).to_owned(),
            named,
            wall_s: begin.elapsed().as_secs_f64(),
        })
    }

    fn diagnose(&self, folder: &Path, moments: &[Moment]) -> Result<Value> {
        let mut text = String::from("time_s,voltage_v,stiffness\n");
        let mut last_v = f64::NAN;
        for (tick, moment) in moments.iter().enumerate() {
            let from_s = tick as f64 * TICK_S;
            // The controller may change its direction within a few ticks: each change of voltage is a row, without a
            // reading.
            if moment.commanded_v != last_v {
                text += &format!("{from_s:.6},{},-\n", moment.commanded_v);
                last_v = moment.commanded_v;
            }
            if tick % EVERY == 0 {
                text += &format!("{:.6},{},{}\n", from_s + READ_S, moment.commanded_v, moment.read_v);
            }
        }
        let record = folder.join("record.csv");
        fs::write(&record, text)?;
        let mut vsj = self.vsj(folder);
        vsj.args(["diagnose", "record.csv", "--out", "diagnosis", "--json"]);
        shell::json(&mut vsj)
    }

    /// The model that the diagnosis exported, unless it is the paper's.
    fn model(&self, folder: &Path) -> Result<Option<WireModel>> {
        let path = folder.join("diagnosis/plant.toml");
        if !path.exists() {
            return Ok(None);
        }
        let model = plant_file::load(&path.display().to_string())?.wire()?;
        let paper = plant_file::PlantFile::from(Plant::PAPER).wire()?;
        Ok((model != paper).then_some(model))
    }

    /// Sends the model over the link with `vsj link`. The board restarts. An error unless it reports this model
    /// afterwards.
    fn send(&self, folder: &Path, model: &WireModel) -> Result<()> {
        // A socket's path has to be short. Each thread has its own.
        let thread = rayon::current_thread_index().unwrap_or_default();
        let socket = self.stage.elf.with_file_name(format!("story-{}-{thread}", std::process::id()));
        let port = format!("unix:{}", socket.display());
        let send = || {
            drop(talk::open(&port)?);
            let mut vsj = self.vsj(folder);
            shell::json(vsj.args(["link", &port, "model", "diagnosis/plant.toml", "--timeout", "10", "--json"]))
        };
        let (models, _) = emulator::obey_in(folder, &self.stage.elf, &socket, |_| {}, send)?;
        let payload = model.payload().context("a model that does not fit")?;
        let expected = serde_json::to_value(BlockId::of(1, &payload))?;
        for which in ["active", "stored"] {
            if models[which] != expected {
                bail!("the {which} model is {} instead of {expected}", models[which]);
            }
        }
        Ok(())
    }

    fn vsj(&self, folder: &Path) -> Command {
        let mut command = shell::command(&self.vsj);
        command.current_dir(folder);
        command
    }
}

/// The reason why there is no second run, for the table.
fn remark(cause: Option<Cause>, named: &[String], sent: bool) -> &'static str {
    match cause {
        _ if sent => "",
        None => "nothing is wrong",
        _ if named.is_empty() => "nothing was found",
        Some(cause) if cause.block() == Block::Reading => "an effect on the readings: nothing to correct",
        Some(_) => "found, but no block of the tick: nothing to send",
    }
}
