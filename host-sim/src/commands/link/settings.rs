//! `vsj link PORT settings`: the settings that the MCU runs, or new ones for it.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use host_sim::link::Failure;
use host_sim::output::terminal::{json, print, remark};
use link::{Blocks, Reason, WireSettings};
use model::{ExtendedPlant, Margin, Plant};
use serde::Serialize;
use simulation::bad_input;
use simulation::has_reference::{remark_on_any_fall_back, remark_on_fall_back};
use simulation::plant_file::PlantFile;
use simulation::settings_file::{SettingsFile, Source};

use super::session::Session;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// A settings file, see docs/settings.toml, at most 1 MiB; what it does not name is
    /// sent as built into the image that runs
    #[arg(value_name = "FILE.toml")]
    file: Option<PathBuf>,
    /// Show the running settings, as a file; also without any argument
    #[arg(long, conflicts_with_all = ["file", "default"])]
    show: bool,
    /// Send the settings that are built into the image
    #[arg(long, conflicts_with = "file")]
    default: bool,
}

/// The answer with `--json`.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    blocks: Blocks,
    settings: SettingsFile,
}

impl Arguments {
    /// Reads the file, before anything is sent.
    pub(super) fn read(&self) -> Result<Option<Source>> {
        match &self.file {
            Some(path) => Source::open(path).map(Some),
            None if self.default => Source::parse("--default", "schema = 1").map(Some),
            None => Ok(None),
        }
    }
}

pub(super) fn run(session: &mut Session, arguments: &Arguments, source: Option<&Source>) -> Result<()> {
    let name = session.client.name().to_owned();
    let blocks = match source {
        None => session.client.settings(),
        Some(source) => {
            let built_in = session.client.read_settings(true).with_context(|| name.clone())?;
            session.client.install_settings(&source.over(&built_in)?)
        }
    };
    let blocks = match blocks {
        Err(Failure::Refused(reason @ (Reason::BadSettings { .. } | Reason::NotBuiltIn(_)))) => {
            let file = arguments.file.as_ref().map_or_else(|| "--default".into(), |file| file.display().to_string());
            bad_input!("{file}: {reason}")
        }
        blocks => blocks.with_context(|| name.clone())?,
    };
    let running = session.client.read_settings(false).with_context(|| name.clone())?;
    if margin(&running).is_some_and(|margin| margin.fall_back > 0.0) {
        // Of a stored model the MCU says nothing but its identity.
        let is_built_in = session.client.models().with_context(|| name.clone())?.active.number == 0;
        let built_in = is_built_in.then(|| PlantFile::from(Plant::PAPER));
        remark_on_margin(&name, &running, built_in.as_ref().map(PlantFile::extended));
    }
    let settings = SettingsFile::from(&running);
    print(&if session.json {
        json(&Report { blocks, settings })?
    } else {
        format!("# runs    {}\n# stored  {}\n{}", blocks.active, blocks.stored, settings.to_toml()?)
    })
}

/// The margin of the robust controller, if it is the one that runs.
fn margin(settings: &WireSettings) -> Option<Margin> {
    settings.margin.and_then(Margin::from_values)
}

/// Remarks on a fall back that has no effect with the MCU's model, or with any if that is not known.
pub(super) fn remark_on_margin(name: &str, settings: &WireSettings, plant: Option<ExtendedPlant>) {
    let Some(margin) = margin(settings) else { return };
    let text = match plant {
        Some(plant) => remark_on_fall_back(plant, &margin),
        None => remark_on_any_fall_back(&margin),
    };
    text.iter().for_each(|text| remark(&format!("{name}: {text}")));
}
