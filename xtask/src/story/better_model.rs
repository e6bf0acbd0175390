//! The board is sent a better model: run, diagnose, extend, run again.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use link::{ModelId, WireModel};
use model::Plant;
use serde::Serialize;
use serde_json::Value;
use simulation::plant_file;
use validation::ground_truth::{Block, Cause};

use super::lock_step::{Moment, NEVER, TICK_S};
use super::stage::{EVERY, Errors, Stage, name};
use crate::variant::Controller;
use crate::{emulator, image, shell, talk};

/// From the beginning of a tick to its reading, in s: just before the voltage may change again.
const READ_S: f64 = 0.999 * TICK_S;

/// What came of one effect.
#[derive(Serialize)]
pub(super) struct Told {
    pub(super) effect: &'static str,
    pub(super) verdict: String,
    pub(super) named: Vec<String>,
    pub(super) right: bool,
    pub(super) before: Errors,
    /// None where there was nothing to send.
    pub(super) after: Option<Errors>,
    pub(super) remark: String,
    pub(super) wall_s: f64,
}

/// The stage, and `vsj`.
pub(super) struct Teller {
    stage: Stage,
    vsj: PathBuf,
}

impl Teller {
    pub(super) fn new(controller: Controller) -> Result<Self> {
        let stage = Stage::new(controller, &[])?;
        shell::run(shell::cargo().args(["build", "--quiet", "--release", "-p", "host-sim", "--bin", "vsj"]))?;
        Ok(Self { stage, vsj: image::target_directory()?.join("release/vsj") })
    }

    pub(super) fn tell(&self, cause: Option<Cause>, seed: u64) -> Result<Told> {
        let begin = Instant::now();
        let folder = self.stage.folder(cause)?;
        let lead = |found: Option<&WireModel>| {
            let way = self.stage.lead(self.stage.run, &folder, self.stage.spring(cause, seed), NEVER, found)?;
            anyhow::Ok(way.moments)
        };
        let first = lead(None)?;
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
                Some(Errors::of(&lead(Some(model))?))
            }
        };
        let right = named.first().map(String::as_str) == cause.map(|cause| cause.name());
        Ok(Told {
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
            // The controller may turn within a few ticks: each change of the voltage is a row, though without a reading.
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

    /// What the diagnosis made of the spring, if it is another one than the paper's.
    fn model(&self, folder: &Path) -> Result<Option<WireModel>> {
        let path = folder.join("diagnosis/plant.toml");
        if !path.exists() {
            return Ok(None);
        }
        let model = plant_file::load(&path.display().to_string())?.wire()?;
        let paper = plant_file::PlantFile::from(Plant::PAPER).wire()?;
        Ok((model != paper).then_some(model))
    }

    /// Over the link, as a user does. The board restarts, and says that it runs this very model.
    fn send(&self, folder: &Path, model: &WireModel) -> Result<()> {
        // The path of a socket has to be short, and is this thread's alone.
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
        let expected = serde_json::to_value(ModelId::of(1, &payload))?;
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

/// Why there is no better second run.
fn remark(cause: Option<Cause>, named: &[String], sent: bool) -> &'static str {
    match cause {
        _ if sent => "",
        None => "nothing is wrong",
        _ if named.is_empty() => "nothing was found",
        Some(cause) if cause.block() == Block::Reading => "the readings' fault: nothing to correct",
        Some(_) => "found, but not run by the tick: nothing to send",
    }
}
