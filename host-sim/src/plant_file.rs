//! The spring as a TOML file, for `--plant FILE.toml`. Only `schema` and `[relaxation]` are needed; this is all of it:
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

/// A plant file, in SI units. Optional tables stand for effects that the spring has; without them it is the plain one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantFile {
    /// Version of the format: 1.
    pub schema: u32,
    /// Hysteresis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<Memory>,
    /// Sensitivity over the voltage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law: Option<Law>,
    /// Loss of charge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leakage: Option<Leakage>,
    /// What comes at once, and what later.
    pub relaxation: Relaxation,
    /// What the record's amplifier did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub amplifier: Option<Amplifier>,
    /// Effects that the tick does not run; kept as they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unmodelled: Option<toml::Table>,
}

/// A bank of play operators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Weight of the voltage itself.
    pub direct: f64,
    /// Half the width of each play, in V.
    pub thresholds_v: Vec<f64>,
    /// Weight of each play.
    pub weights: Vec<f64>,
}

/// A static law, straight between points and beyond them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// Upwards from 0 V.
    pub voltage_v: Vec<f64>,
    /// At each of them, in V; from 0.
    pub stiffness: Vec<f64>,
}

/// Stiffness that is lost while the voltage stays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Leakage {
    /// Part that is lost in the end, 0 to 1.
    pub share: f64,
    /// Time constant, in s.
    pub tau_s: f64,
}

/// The instantaneous share and the lags.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relaxation {
    /// Part of a change that comes at once.
    pub share: f64,
    /// Time constants, in s; in the file a single one without weight is a number.
    #[serde(with = "one_or_more")]
    pub tau_s: Vec<f64>,
    /// What each time constant brings; none for a single one that brings `1 - share`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weights: Vec<f64>,
    /// The first time constant at 500 V, in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tau_high_s: Option<f64>,
}

/// The amplifier that a record was made with.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Amplifier {
    /// Where its voltage ended, in V, 10 to 1000.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit_v: Option<f64>,
    /// Its fastest change, in V/s, 1 to 1e9.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slew_v_per_s: Option<f64>,
    /// How late it answered, in s, 0 to 60.
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
    /// The spring as the estimator's extended tick takes it.
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

    /// As it is sent to the MCU.
    ///
    /// # Errors
    /// [`OutOfRange`] as [`PlantFile::check`]: what that accepts can be sent.
    pub fn wire(&self) -> Result<WireModel, OutOfRange> {
        self.check()?;
        let amplifier = self.amplifier.clone().unwrap_or_default();
        let wire = WireModel::new(&self.extended(), amplifier.limit_v, amplifier.slew_v_per_s);
        wire.ok_or(OutOfRange { field: "lists", value: f64::NAN, lowest: 0.0, highest: 9.0, unit: "numbers" })
    }

    /// Whether the tick can run it: at the fastest rate; a slower one may refuse a short time constant later.
    ///
    /// # Errors
    /// [`OutOfRange`] names table and field as they are in the file, and what is allowed.
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

    /// An amplifier with the limit and slew that the file records, where they are stricter.
    pub fn behind(&self, amplifier: model::Amplifier) -> model::Amplifier {
        let Some(Amplifier { limit_v, slew_v_per_s, .. }) = self.amplifier else { return amplifier };
        amplifier.limited_to(limit_v, slew_v_per_s)
    }

    /// What the file says of the record that neither the tick nor its amplifier stage runs, by name.
    pub fn left_out(&self) -> Vec<String> {
        let delayed = self.amplifier.as_ref().is_some_and(|amplifier| amplifier.delay_s.is_some());
        let unmodelled =
            self.unmodelled.iter().flat_map(|table| table.keys().map(|key| key.escape_debug().to_string()));
        delayed.then(|| "amplifier.delay_s".to_owned()).into_iter().chain(unmodelled).collect()
    }

    /// The file's text.
    ///
    /// # Errors
    /// If `unmodelled` holds what TOML cannot.
    pub fn to_toml(&self) -> Result<String> {
        Ok(toml::to_string(self)?)
    }
}

/// `paper`, or the path of a file.
///
/// # Errors
/// [`crate::BadInput`] with file, line, column and what was expected.
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

/// The same where only the plain spring will do.
///
/// # Errors
/// As [`load`], and for a file with more than that.
pub fn load_plain(plant: &str) -> Result<Plant> {
    match load(plant)?.extended().plain() {
        Some(plain) => Ok(plain),
        None => bad_input!("{plant}: an extended spring; expected [relaxation] with one share and tau_s only"),
    }
}

/// The plant file `text`, called `name` in messages.
///
/// # Errors
/// As [`load`].
pub fn parse(name: &str, text: &str) -> Result<PlantFile> {
    let file: PlantFile = toml::from_str(text).map_err(|error| {
        let (at, what) = (error.span().map_or(0, |span| span.start), error.message().replace('\n', ", "));
        let expected = "expected schema, [relaxation] share and tau_s, and the tables of a plant file";
        BadInput(format!("{}: {what}; {expected}", place::line_and_column(name, text, at)))
    })?;
    if let Err(error) = file.check() {
        let at = place::of_field(text, error.field, error.value);
        // The place says in which table.
        let field = error.field.rsplit('.').next().unwrap_or(error.field);
        bad_input!("{}: {}", place::line_and_column(name, text, at), OutOfRange { field, ..error });
    }
    Ok(file)
}

#[cfg(test)]
mod tests;
