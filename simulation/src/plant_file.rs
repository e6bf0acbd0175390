//! The spring as a TOML file, for `--plant FILE.toml`. `schema` and `[relaxation]` are required; the complete format is
//!
#![doc = concat!("```toml\n", include_str!("../../docs/plant.toml"), "```")]
//!
//! The equations are those of [`model::extended`].

mod one_or_more;
mod place;

use std::path::Path;

use anyhow::Result;
use link::WireModel;
use model::{ExtendedPlant, OutOfRange, Plant, SampleTime, Validate, extended};
use serde::{Deserialize, Serialize};

use crate::bad_input;
use crate::bad_input::BadInput;

/// A plant file, in SI units. Each optional table adds an effect to the plain spring.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantFile {
    /// Version of the format: 1.
    pub schema: u32,
    /// Hysteresis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<Memory>,
    /// Static nonlinearity: stiffness over the voltage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law: Option<Law>,
    /// Charge leakage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leakage: Option<Leakage>,
    /// Instantaneous part and relaxation.
    pub relaxation: Relaxation,
    /// Limits of the amplifier with which the record was made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub amplifier: Option<Amplifier>,
    /// Effects that the tick does not simulate, kept unchanged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unmodelled: Option<toml::Table>,
}

/// A bank of play operators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Weight of the voltage itself, dimensionless.
    pub direct: f64,
    /// Half the width of each play operator, in V.
    pub thresholds_v: Vec<f64>,
    /// Weight of each play operator, dimensionless.
    pub weights: Vec<f64>,
}

/// A static law, linear between its points and beyond them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// Voltages of the points, in V, increasing from 0 V.
    pub voltage_v: Vec<f64>,
    /// Stiffness at each point as the equivalent static voltage, in V; 0 at the first.
    pub stiffness: Vec<f64>,
}

/// Loss of stiffness at constant voltage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Leakage {
    /// Part that is finally lost, 0 to 1.
    pub share: f64,
    /// Time constant, in s.
    pub tau_s: f64,
}

/// The instantaneous share and the lags.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relaxation {
    /// Part of a change that is instantaneous, 0 to 0.9.
    pub share: f64,
    /// Time constants, in s; the file may give a single one as a plain number.
    #[serde(with = "one_or_more")]
    pub tau_s: Vec<f64>,
    /// Share of each time constant; empty for a single one with the share `1 - share`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weights: Vec<f64>,
    /// Value of the first time constant at 500 V, in s; the time constant in `tau_s` is then its value at 0 V.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tau_high_s: Option<f64>,
}

/// The amplifier with which a record was made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Amplifier {
    /// Highest voltage, in V, 10 to 1000.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit_v: Option<f64>,
    /// Slew limit, in V/s, 1 to 1e9.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slew_v_per_s: Option<f64>,
    /// Delay, in s, 0 to 60.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay_s: Option<f64>,
}

impl From<Plant> for PlantFile {
    fn from(plant: Plant) -> Self {
        let relaxation = Relaxation {
            share: plant.share,
            tau_s: vec![plant.time_constant_s],
            weights: Vec::new(),
            tau_high_s: None,
        };
        Self { schema: 1, memory: None, law: None, leakage: None, relaxation, amplifier: None, unmodelled: None }
    }
}

impl PlantFile {
    /// The spring in the form that the estimator's extended tick takes.
    pub fn extended(&self) -> ExtendedPlant<'_> {
        ExtendedPlant {
            memory: self.memory.as_ref().map(|memory| extended::Memory {
                direct: memory.direct,
                thresholds_v: &memory.thresholds_v,
                weights: &memory.weights,
            }),
            law: self.law.as_ref().map(|law| extended::Law { voltage_v: &law.voltage_v, stiffness: &law.stiffness }),
            leakage: self
                .leakage
                .as_ref()
                .map(|leakage| extended::Leakage { share: leakage.share, time_constant_s: leakage.tau_s }),
            relaxation: extended::Relaxation {
                share: self.relaxation.share,
                time_constants_s: &self.relaxation.tau_s,
                weights: &self.relaxation.weights,
                time_constant_high_s: self.relaxation.tau_high_s,
            },
        }
    }

    /// The model in the form that is sent to the MCU.
    ///
    /// # Errors
    /// [`OutOfRange`] under the conditions of [`PlantFile::check`]; a file that passes it can be sent.
    pub fn wire(&self) -> Result<WireModel, OutOfRange> {
        self.check()?;
        let amplifier = self.amplifier.clone().unwrap_or_default();
        let wire = WireModel::new(&self.extended(), amplifier.limit_v, amplifier.slew_v_per_s);
        wire.ok_or(OutOfRange { field: "lists", value: f64::NAN, lowest: 0.0, highest: 9.0, unit: "numbers" })
    }

    /// Checks whether the tick can run the spring at 10 kHz; at a lower rate a short time constant may still be
    /// rejected.
    ///
    /// # Errors
    /// [`OutOfRange`] with table and field as named in the file, and the allowed range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let refused = |field, value, lowest, highest, unit| Err(OutOfRange { field, value, lowest, highest, unit });
        if self.schema != 1 {
            return refused("schema", f64::from(self.schema), 1.0, 1.0, "as version of the format");
        }
        let sample_time = SampleTime::from_rate(10_000.0)?;
        match self.extended().plain() {
            Some(plant) => plant.check(sample_time).map_err(|error| match error.field {
                "share" => OutOfRange { field: "relaxation.share", ..error },
                _ => OutOfRange { field: "relaxation.tau_s", ..error },
            })?,
            None => self.extended().check(sample_time)?,
        }
        let amplifier = self.amplifier.clone().unwrap_or_default();
        for (field, value, lowest, highest, unit) in [
            ("amplifier.limit_v", amplifier.limit_v, 10.0, 1000.0, "V"),
            ("amplifier.slew_v_per_s", amplifier.slew_v_per_s, 1.0, 1e9, "V/s"),
            ("amplifier.delay_s", amplifier.delay_s, 0.0, 60.0, "s"),
        ] {
            if let Some(value) = value.filter(|value| !(lowest..=highest).contains(value)) {
                return refused(field, value, lowest, highest, unit);
            }
        }
        Ok(())
    }

    /// The amplifier with the file's limit and slew where they are stricter.
    pub fn behind(&self, amplifier: model::Amplifier) -> model::Amplifier {
        let Some(Amplifier { limit_v, slew_v_per_s, .. }) = self.amplifier else { return amplifier };
        amplifier.limited_to(limit_v, slew_v_per_s)
    }

    /// Names of the file's effects that neither the tick nor its amplifier stage simulates.
    pub fn left_out(&self) -> Vec<String> {
        let delayed = self.amplifier.as_ref().is_some_and(|amplifier| amplifier.delay_s.is_some());
        let unmodelled =
            self.unmodelled.iter().flat_map(|table| table.keys().map(|key| key.escape_debug().to_string()));
        delayed.then(|| "amplifier.delay_s".to_owned()).into_iter().chain(unmodelled).collect()
    }

    /// Formats the file as TOML.
    ///
    /// # Errors
    /// If `unmodelled` holds a value that TOML cannot represent.
    pub fn to_toml(&self) -> Result<String> {
        Ok(toml::to_string(self)?)
    }
}

/// Loads the report's spring for `paper`, or the plant file of that path.
///
/// # Errors
/// [`crate::bad_input::BadInput`] with file, line, column and what was expected.
pub fn load(plant: &str) -> Result<PlantFile> {
    if plant == "paper" {
        return Ok(Plant::PAPER.into());
    }
    let unreadable = |error| BadInput(format!("{plant}: cannot be read: {error}; expected `paper` or a plant file"));
    let text = String::from_utf8(std::fs::read(Path::new(plant)).map_err(unreadable)?).map_err(|error| {
        let end = error.utf8_error().valid_up_to();
        let before = String::from_utf8_lossy(&error.as_bytes()[..end]);
        BadInput(format!("{}: not UTF-8; expected a text in UTF-8", place::line_and_column(plant, &before, end)))
    })?;
    parse(plant, &text)
}

/// Loads like [`load`], but accepts the plain spring only.
///
/// # Errors
/// The errors of [`load`], and [`crate::bad_input::BadInput`] for an extended spring.
pub fn load_plain(plant: &str) -> Result<Plant> {
    match load(plant)?.extended().plain() {
        Some(plain) => Ok(plain),
        None => bad_input!("{plant}: an extended spring; expected [relaxation] with one share and tau_s only"),
    }
}

/// Parses the plant file `text`, called `name` in messages.
///
/// # Errors
/// The errors of [`load`].
pub fn parse(name: &str, text: &str) -> Result<PlantFile> {
    let file: PlantFile = toml::from_str(text).map_err(|error| {
        let (at, what) = (error.span().map_or(0, |span| span.start), error.message().replace('\n', ", "));
        let expected = "expected schema, [relaxation] share and tau_s, and the tables of a plant file";
        BadInput(format!("{}: {what}; {expected}", place::line_and_column(name, text, at)))
    })?;
    if let Err(error) = file.check() {
        let at = place::of_field(text, error.field, error.value);
        // The position already tells the table.
        let field = error.field.rsplit('.').next().unwrap_or(error.field);
        bad_input!("{}: {}", place::line_and_column(name, text, at), OutOfRange { field, ..error });
    }
    Ok(file)
}

#[cfg(test)]
mod tests;
