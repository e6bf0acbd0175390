//! A unit: its kind, its spring and the settings of its controller.

use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use simulation::bad_input::BadInput;
use simulation::bounded_file::read_text;
use simulation::control_loop::{Controller, Options};
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

/// The options as `unit.toml` has them.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    kind: Kind,
    controller: String,
    limit_v: f64,
    min_v: f64,
    slew_v_per_s: Option<f64>,
    dac_bits: u32,
    kp: f64,
    ki: f64,
    approach_s: Option<f64>,
    rate_hz: f64,
}

impl Unit {
    /// Text of the file [`SETTINGS`].
    ///
    /// # Errors
    /// None that is known: every field is a number or a word.
    pub fn settings_file(&self) -> Result<String> {
        let Options { controller, limit_v, min_v, slew_v_per_s, dac_bits, kp, ki, approach_s, rate_hz, feedback: _ } =
            self.options;
        let controller = controller.name().to_owned();
        let file =
            File { kind: self.kind, controller, limit_v, min_v, slew_v_per_s, dac_bits, kp, ki, approach_s, rate_hz };
        Ok(toml::to_string(&file)?)
    }

    /// Reads a unit from its `resources`.
    ///
    /// # Errors
    /// [`BadInput`] with file, line, column and what was expected.
    pub fn read(resources: &Path) -> Result<Self> {
        let settings = resources.join(SETTINGS);
        let text = read_text(&settings, 1, "the settings of a unit")?;
        let file: File = toml::from_str(&text)
            .map_err(|error| BadInput(format!("{}: {}", settings.display(), error.message())))
            .context("the unit is damaged")?;
        let options = Options {
            controller: Controller::by_name(&file.controller)?,
            limit_v: file.limit_v,
            min_v: file.min_v,
            slew_v_per_s: file.slew_v_per_s,
            dac_bits: file.dac_bits,
            kp: file.kp,
            ki: file.ki,
            approach_s: file.approach_s,
            rate_hz: file.rate_hz,
            feedback: None,
        };
        let plant = plant_file::load(&resources.join(PLANT).to_string_lossy())?;
        Ok(Self { kind: file.kind, plant, options })
    }
}
