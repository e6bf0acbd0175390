//! A unit: its kind, its spring and the settings of its controller.

use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use simulation::bad_input::BadInput;
use simulation::bounded_file::read_text;
use simulation::control_loop::Options;
use simulation::plant_file::{self, PlantFile};

/// File with the kind and the settings of a unit, in its `resources`.
pub const SETTINGS: &str = "unit.toml";
/// File with the spring of a unit, in its `resources`: a copy of the plant file.
pub const PLANT: &str = "plant.toml";

/// Parts that a unit contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The spring alone: a voltage in, its stiffness out.
    Spring,
    /// The controller: a target in, the voltage out.
    Controller,
    /// Controller and spring: a target in, the stiffness of the spring out.
    Both,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Spring, Self::Controller, Self::Both];

    /// Name on the command line and in the names of files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Spring => "spring",
            Self::Controller => "controller",
            Self::Both => "both",
        }
    }

    /// True if the unit contains the simulated spring.
    pub const fn has_spring(self) -> bool {
        !matches!(self, Self::Controller)
    }

    /// True if the unit contains the controller.
    pub const fn has_controller(self) -> bool {
        !matches!(self, Self::Spring)
    }
}

/// Everything that tells one unit from another.
#[derive(Clone, Debug)]
pub struct Unit {
    /// The parts.
    pub kind: Kind,
    /// The spring, and the model that the controller has of it.
    pub plant: PlantFile,
    /// The controller's settings; a spring alone has the rate from here.
    pub options: Options,
}

/// The content of `unit.toml`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    kind: Kind,
    options: Options,
}

impl Unit {
    /// Text of the file [`SETTINGS`].
    ///
    /// # Errors
    /// None that is known: every field is a number or a word.
    pub fn settings_file(&self) -> Result<String> {
        Ok(toml::to_string(&File { kind: self.kind, options: self.options })?)
    }

    /// Reads a unit from its `resources`.
    ///
    /// # Errors
    /// [`BadInput`] with file, line, column and what was expected.
    pub fn read(resources: &Path) -> Result<Self> {
        let settings = resources.join(SETTINGS);
        let text = read_text(&settings, 1, "the settings of a unit")?;
        let File { kind, options } = toml::from_str(&text)
            .map_err(|error| BadInput(format!("{}: {}", settings.display(), error.message())))
            .context("the unit is damaged")?;
        let plant = plant_file::load(&resources.join(PLANT).to_string_lossy())?;
        Ok(Self { kind, plant, options })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::control_loop::Controller;

    #[test]
    fn a_unit_is_read_from_its_files_as_it_was_written() {
        let options =
            Options { controller: Controller::Fast, approach_s: Some(0.1), limit_v: 0.1 + 600.0, ..Options::PAPER };
        let unit = Unit { kind: Kind::Both, plant: plant_file::load("paper").expect("the report's spring"), options };
        let folder = std::env::temp_dir().join(format!("vsj-unit-{}", std::process::id()));
        let (_, plant) = plant_file::load_with_text("paper").expect("the report's spring");
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(folder.join(PLANT), plant).expect("a file");
        let text = unit.settings_file().expect("TOML");
        std::fs::write(folder.join(SETTINGS), &text).expect("a file");
        let read = Unit::read(&folder).expect("a unit");
        assert_eq!((read.kind, read.plant, read.options), (unit.kind, unit.plant, unit.options));
        std::fs::write(folder.join(SETTINGS), text.replace("fast", "slow")).expect("a file");
        let error = Unit::read(&folder).expect_err("no controller");
        assert!(
            error.is::<BadInput>() && format!("{error:#}").contains("expected one of `none`, `paper`, `fast`"),
            "{error:#}"
        );
        std::fs::remove_dir_all(&folder).expect("it is there");
    }
}
