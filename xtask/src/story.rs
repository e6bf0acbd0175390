//! The whole story in one run, for each effect that a spring may hide:
//!
//! 1. The emulated board leads the hidden spring up and down a stair, with the paper's model of it.
//! 2. `vsj diagnose` reads the record and names the cause.
//! 3. `vsj link` sends the extended model to the board, which checks it, stores it and restarts.
//! 4. The board, started anew, leads the same spring up and down again.
//!
//! What counts is the true stiffness beside the desired one, from the hidden spring itself. Both runs are held against
//! the same code on this machine, code by code.

mod lock_step;
mod table;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use end_to_end::hidden::live::Live;
use end_to_end::hidden::{Block, Cause, Effect, Noise, Schedule};
use firmware::RATE_HZ;
use firmware::script::{self, Script, UP_DOWN_TICKS, up_down_v};
use firmware::settings::Leader;
use host_sim::plant_file;
use link::{ModelId, WireModel};
use model::Plant;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;

use crate::emulate::Comparison;
use crate::emulator;
use crate::image::{self, Board, Opt};
use crate::{setup, shell, talk};
use lock_step::Moment;

/// Ticks between two rows of the record.
const EVERY: usize = 50;
/// White noise on the readings, in percent of 500 V.
const NOISE_PERCENT: f64 = 0.2;
/// The part of each step that counts as settled, in ticks before its end.
const SETTLED: usize = 2 * RATE_HZ as usize;
/// Told in every test: one of each block that a model can be extended by.
const IN_TEST: [Cause; 3] = [Cause::Hysteresis, Cause::TimeConstant, Cause::ChargeLeakage];

/// Options of `cargo xtask story`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Hide this effect, or several; three of them without
    #[arg(long, value_name = "NAME", num_args = 1.., value_parser = named)]
    effect: Vec<Cause>,
    /// Hide each effect in turn, and none
    #[arg(long, conflicts_with = "effect")]
    all: bool,
    /// Who leads the spring: `paper`, or `fast` in an image of its own
    #[arg(long, default_value = "paper", value_parser = leader)]
    controller: Leader,
    /// Where the effects' sizes and the noise come from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
    /// Approve the summary of the three effects as it is now
    #[arg(long, conflicts_with_all = ["effect", "all", "controller"])]
    bless: bool,
}

fn named(name: &str) -> Result<Cause, String> {
    let names: Vec<_> = Cause::ALL.iter().map(|cause| cause.name()).collect();
    Cause::named(name).ok_or_else(|| format!("expected one of {}", names.join(", ")))
}

fn leader(name: &str) -> Result<Leader, String> {
    match name {
        "paper" => Ok(Leader::Paper),
        "fast" => Ok(Leader::Fast),
        _ => Err("expected paper or fast".to_owned()),
    }
}

/// What came of one effect.
#[derive(Serialize)]
pub(crate) struct Told {
    effect: &'static str,
    verdict: String,
    named: Vec<String>,
    right: bool,
    before: Errors,
    /// None where there was nothing to send.
    after: Option<Errors>,
    remark: String,
    wall_s: f64,
}

/// True stiffness less target, in V.
#[derive(Clone, Copy, Serialize)]
struct Errors {
    /// Root mean square over the run.
    rms_v: f64,
    /// The largest mean of the settled part of a step, without its sign.
    worst_plateau_v: f64,
}

impl Errors {
    fn of(moments: &[Moment]) -> Self {
        let errors: Vec<f64> = (0..).zip(moments).map(|(tick, m)| m.stiffness_v - f64::from(up_down_v(tick))).collect();
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let squares: Vec<f64> = errors.iter().map(|error| error * error).collect();
        // Each step lasts 10 s, from 5 s on.
        let steps = 5_000..=errors.len();
        let ends = steps.step_by(10_000).map(|end| mean(&errors[end - SETTLED..end]).abs());
        Self { rms_v: mean(&squares).sqrt(), worst_plateau_v: ends.fold(0.0, f64::max) }
    }
}

/// `cargo xtask story`.
pub(crate) fn run(args: &Args) -> Result<()> {
    setup::emulator()?;
    let effects: Vec<Option<Cause>> = match (args.all, args.effect.as_slice()) {
        (true, _) => [None].into_iter().chain(Cause::ALL.map(Some)).collect(),
        (false, []) => IN_TEST.map(Some).to_vec(),
        (false, given) => given.iter().copied().map(Some).collect(),
    };
    let stage = Stage::new(args.controller)?;
    let told = stage.tell_all(&effects, args.seed)?;
    if args.bless {
        table::bless(&told)?;
    }
    if args.json {
        println!("{}", serde_json::to_string(&told)?);
    } else {
        print!("{}", table::table(&told, 2));
    }
    Ok(())
}

/// As a step of `cargo xtask test`: three effects, the summary as approved.
pub(crate) fn check() -> Result<()> {
    let begin = Instant::now();
    let stage = Stage::new(Leader::Paper)?;
    table::compare(&stage.tell_all(&IN_TEST.map(Some), 1)?)?;
    eprintln!("the story of three effects in {:.0} s, as approved", begin.elapsed().as_secs_f64());
    Ok(())
}

fn name(effect: Option<Cause>) -> &'static str {
    effect.map_or("none", |cause| cause.name())
}

/// What every story needs.
struct Stage {
    leader: Leader,
    elf: PathBuf,
    vsj: PathBuf,
    folder: PathBuf,
    /// The paper's spring on the way up and down: the schedule that the effects' sizes are drawn for, and its stiffness.
    schedule: Schedule,
    top_v: f64,
}

impl Stage {
    fn new(leader: Leader) -> Result<Self> {
        let features: &[&str] = match leader {
            Leader::Paper => &[],
            Leader::Fast => &["fast"],
        };
        let elf = image::build_with(features, Board::Mps2, Opt::S)?;
        shell::run(shell::cargo().args(["build", "--quiet", "--release", "-p", "host-sim", "--bin", "vsj"]))?;
        let target = image::target_directory()?;
        let (mut rows, mut top_v, mut tick) = (Vec::new(), 0f64, 0);
        script::rehearse(Script::UpDown(leader), |_, done| {
            if tick % EVERY == 0 {
                rows.push((tick as f64 / f64::from(RATE_HZ), done.output.applied.to_f64()));
            }
            top_v = top_v.max(done.output.stiffness.to_f64());
            tick += 1;
        })?;
        let (time_s, voltage_v) = rows.into_iter().unzip();
        Ok(Self {
            leader,
            elf,
            vsj: target.join("release/vsj"),
            folder: target.join("story"),
            schedule: Schedule { time_s, voltage_v },
            top_v,
        })
    }

    /// One board and one spring for each effect, all at once.
    fn tell_all(&self, effects: &[Option<Cause>], seed: u64) -> Result<Vec<Told>> {
        let tell = |&effect: &Option<Cause>| {
            let told = self.tell(effect, seed).with_context(|| name(effect))?;
            eprintln!("{}", table::line(&told, 2));
            Ok(told)
        };
        effects.par_iter().map(tell).collect()
    }

    fn tell(&self, cause: Option<Cause>, seed: u64) -> Result<Told> {
        let begin = Instant::now();
        let folder = self.folder.join(name(cause));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        fs::write(folder.join("model.flash"), vec![0xff; 2 * firmware::store::PAGE])?;
        let noise = Noise::white(NOISE_PERCENT);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let draw = |cause| Effect::draw(&mut random, cause, 0, &self.schedule, noise.sigma_v);
        let effects: Vec<Effect> = cause.map(draw).into_iter().collect();
        let spring = || Live::new(&effects, noise, seed, self.top_v, UP_DOWN_TICKS as usize);

        let first = self.lead(&folder, spring(), None)?;
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
                Some(Errors::of(&self.lead(&folder, spring(), Some(model))?))
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

    /// One way up and down on the board, held against this machine.
    fn lead(&self, folder: &Path, spring: Live, found: Option<&WireModel>) -> Result<Vec<Moment>> {
        let (run, moments) = lock_step::run(&self.elf, self.leader.up_down(), folder, spring)?;
        Comparison::with(self.leader.up_down(), found, &run)?.check()?;
        ensure!(moments.len() == UP_DOWN_TICKS as usize, "{} ticks at the spring", moments.len());
        Ok(moments)
    }

    fn diagnose(&self, folder: &Path, moments: &[Moment]) -> Result<Value> {
        let mut text = String::from("time_s,voltage_v,stiffness\n");
        for (tick, moment) in moments.iter().enumerate().step_by(EVERY) {
            let time_s = tick as f64 / f64::from(RATE_HZ);
            text += &format!("{time_s},{},{}\n", moment.commanded_v, moment.read_v);
        }
        let record = folder.join("record.csv");
        fs::write(&record, text)?;
        let mut vsj = self.vsj(folder);
        vsj.args(["diagnose", "record.csv", "--input", "linear", "--out", "diagnosis", "--json"]);
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
        let socket = self.elf.with_file_name(format!("story-{}-{thread}", std::process::id()));
        let port = format!("unix:{}", socket.display());
        let send = || {
            drop(talk::open(&port)?);
            let mut vsj = self.vsj(folder);
            shell::json(vsj.args(["link", &port, "model", "diagnosis/plant.toml", "--timeout", "10", "--json"]))
        };
        let (models, _) = emulator::obey_in(folder, &self.elf, &socket, |_| {}, send)?;
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
