//! `vsj link PORT model`: which model of the spring the MCU runs, or a new one for it.

use anyhow::{Context, Result};
use clap::Args;
use host_sim::link::Failure;
use host_sim::{BadInput, bad_input, plant_file};
use link::{Reason, WireModel};

use super::Talk;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// A plant file, as `vsj diagnose --out` writes it, or `paper`
    #[arg(value_name = "FILE.toml|paper")]
    plant: Option<String>,
}

impl Arguments {
    /// What is to be sent.
    pub(super) fn read(&self) -> Result<Option<WireModel>> {
        let Some(plant) = &self.plant else { return Ok(None) };
        let file = plant_file::load(plant)?;
        let left_out = file.left_out();
        if !left_out.is_empty() {
            eprintln!("vsj: {plant}: not run by the MCU: {}", left_out.join(", "));
        }
        Ok(Some(file.wire().map_err(|error| BadInput(format!("{plant}: {error}")))?))
    }
}

pub(super) fn run(talk: &mut Talk, arguments: &Arguments, model: Option<&WireModel>) -> Result<()> {
    let answer = match model {
        None => talk.client.models(),
        Some(model) => talk.client.install(model),
    };
    let models = match answer {
        Err(Failure::Refused(reason @ Reason::BadModel { .. })) => {
            bad_input!("{}: {reason}", arguments.plant.as_deref().unwrap_or_default())
        }
        answer => answer.with_context(|| talk.client.name().to_owned())?,
    };
    if talk.json {
        println!("{}", serde_json::to_string(&models)?);
    } else {
        println!("runs    {}\nstored  {}", models.active, models.stored);
    }
    Ok(())
}
