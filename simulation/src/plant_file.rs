//! The spring as a TOML file, for `--plant FILE.toml`. `schema` and `[relaxation]` are required; the complete format is
//!
#![doc = concat!("```toml\n", include_str!("../../docs/plant.toml"), "```")]
//!
//! The equations are those of [`model::extended`].

mod law_of_tick;
mod one_or_more;
pub(crate) mod place;

use std::path::Path;

use anyhow::Result;
use link::WireModel;
use model::extended::law::MAX_POINTS;
use model::{ExtendedPlant, OutOfRange, Plant, SampleTime, Validate, extended};
use serde::{Deserialize, Serialize};

use crate::bad_input;
use crate::bad_input::{BadInput, excerpt, one_line};
use crate::bounded_file::read_text;
use crate::schedule::STAIR_STEP_V;
use crate::units::UnitNames;

/// Largest size of a plant file, in MiB: some ten thousand times that of the longest that a diagnosis writes.
const MOST_MIB: usize = 1;
/// Largest part of the settled response that the tick may take as instantaneous although it oscillates. A step counts as reached at 97 %:
/// a part above 3 % decides whether and when it is.
const MOST_OSCILLATING: f64 = 0.03;
/// Largest number of play operators, and of points of a law, that a host simulates; the tick has fewer.
const MOST_LISTED: usize = 1000;

/// A plant file, in SI units. Each optional table adds an effect to the plain spring.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantFile {
    /// Version of the format: 1.
    pub schema: u32,
    /// True if the spring responds to the magnitude of the voltage, whatever its sign.
    #[serde(default, skip_serializing_if = "is_false")]
    pub even: bool,
    /// Names of the units in which the spring's quantities are shown to a user; every number of the file is in s and V.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub units: Option<UnitNames>,
    /// The reading for a stiffness; identical numbers without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reading: Option<Reading>,
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
    /// Voltages between which the spring was identified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<Range>,
    /// Oscillations in parallel with the relaxation; the tick takes them as instantaneous.
    #[serde(rename = "mode", default, skip_serializing_if = "Vec::is_empty")]
    pub modes: Vec<Mode>,
    /// Effects that the tick does not simulate, kept unchanged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unmodelled: Option<toml::Table>,
}

/// The map from stiffness to reading: `reading = zero + gain stiffness`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reading {
    /// Change of the reading per V of equivalent static voltage, in the reading's unit per V; not 0.
    pub gain: f64,
    /// Reading at 0 V, in the reading's unit.
    #[serde(default)]
    pub zero: f64,
}

impl Default for Reading {
    /// A reading that is the stiffness, as the equivalent static voltage in V.
    fn default() -> Self {
        Self { gain: 1.0, zero: 0.0 }
    }
}

/// Returns true for false; serde omits such a field.
fn is_false(value: &bool) -> bool {
    !value
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
    /// Value of the first time constant at `tau_high_at_v`, in s; the time constant in `tau_s` is then its value at 0 V.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tau_high_s: Option<f64>,
    /// Voltage at which the time constant is `tau_high_s`, in V; 500 if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tau_high_at_v: Option<f64>,
}

/// An oscillation of the settled stiffness `q`, with `f = 2 pi freq_hz`; its contribution is `weight w + rate_weight v`.
///
/// ```text
/// w'' / f^2 + 2 zeta w' / f + w = q        v = w' / f
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mode {
    /// Undamped frequency, in Hz.
    pub freq_hz: f64,
    /// Damping ratio, above 0 and below 1.
    pub zeta: f64,
    /// Part of the settled stiffness.
    pub weight: f64,
    /// Weight of the rate of change.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rate_weight: f64,
}

/// Returns true for 0; serde omits such a field.
fn is_zero(value: &f64) -> bool {
    *value == 0.0
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

/// The voltages of the record from which a spring was identified.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Lowest voltage, in V.
    pub lowest_v: f64,
    /// Highest voltage, in V; at least the lowest.
    pub highest_v: f64,
}

impl Relaxation {
    /// Voltage at which the time constant is `tau_high_s` unless the file names another, in V.
    pub const HIGH_V: f64 = 500.0;

    /// Value of the first time constant at [`Relaxation::HIGH_V`], in s; `None` if it is constant.
    pub fn tau_at_500_v(&self) -> Option<f64> {
        let low_s = self.tau_s.first().copied().unwrap_or_default();
        let part = Self::HIGH_V / self.tau_high_at_v.unwrap_or(Self::HIGH_V);
        self.tau_high_s.map(|high_s| if part == 1.0 { high_s } else { low_s + (high_s - low_s) * part })
    }
}

impl From<Plant> for PlantFile {
    fn from(plant: Plant) -> Self {
        let relaxation = Relaxation {
            share: plant.share,
            tau_s: vec![plant.time_constant_s],
            weights: Vec::new(),
            tau_high_s: None,
            tau_high_at_v: None,
        };
        let (units, reading) = (None, None);
        Self {
            schema: 1,
            even: false,
            units,
            reading,
            memory: None,
            law: None,
            leakage: None,
            relaxation,
            amplifier: None,
            range: None,
            modes: Vec::new(),
            unmodelled: None,
        }
    }
}

impl PlantFile {
    /// Largest number of oscillations.
    pub const MOST_MODES: usize = 2;

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
                share: self.relaxation.share + self.modes.iter().map(|mode| mode.weight).sum::<f64>(),
                time_constants_s: &self.relaxation.tau_s,
                weights: &self.relaxation.weights,
                time_constant_high_s: self.relaxation.tau_at_500_v(),
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

    fn check_schema(&self) -> Result<(), OutOfRange> {
        let (value, unit) = (f64::from(self.schema), "as version of the format");
        let refused = OutOfRange { field: "schema", value, lowest: 1.0, highest: 1.0, unit };
        if self.schema == 1 { Ok(()) } else { Err(refused) }
    }

    /// Checks that readings can be converted to stiffness and back.
    fn check_reading(&self) -> Result<(), OutOfRange> {
        let Reading { gain, zero } = self.reading.unwrap_or_default();
        let (lowest, highest) = (f64::MIN_POSITIVE, f64::MAX);
        if !(lowest..=highest).contains(&gain.abs()) {
            let unit = "per V, or its negative";
            return Err(OutOfRange { field: "reading.gain", value: gain, lowest, highest, unit });
        }
        if !zero.is_finite() {
            return Err(OutOfRange { field: "reading.zero", value: zero, lowest: -highest, highest, unit: "" });
        }
        Ok(())
    }

    /// Checks that the range of the record does not end below its start.
    fn check_range(&self) -> Result<(), OutOfRange> {
        let Some(Range { lowest_v, highest_v }) = self.range else { return Ok(()) };
        for (field, value, lowest) in
            [("range.lowest_v", lowest_v, -f64::MAX), ("range.highest_v", highest_v, lowest_v)]
        {
            if !(lowest..=f64::MAX).contains(&value) {
                return Err(OutOfRange { field, value, lowest, highest: f64::MAX, unit: "V" });
            }
        }
        Ok(())
    }

    /// Part of the settled response that oscillates, 0 or more: the magnitudes of the weights of all oscillations.
    pub fn oscillating_part(&self) -> f64 {
        if self.modes.is_empty() {
            return 0.0;
        }
        let relaxation = self.extended().relaxation;
        let settled = relaxation.share + relaxation.lags().map(|(_, weight)| weight).sum::<f64>();
        self.modes.iter().map(|mode| mode.weight.abs()).sum::<f64>() / settled.abs()
    }

    /// Checks that next to nothing of the response is in oscillations, which the tick does not simulate.
    fn check_oscillations(&self) -> Result<(), OutOfRange> {
        let (value, unit) =
            (self.oscillating_part(), "of the settled response, because the tick takes oscillations as instantaneous");
        let refused = OutOfRange { field: "mode", value, lowest: 0.0, highest: MOST_OSCILLATING, unit };
        if value <= MOST_OSCILLATING { Ok(()) } else { Err(refused) }
    }

    /// Checks whether the tick can run the spring at 10 kHz; at a lower rate a short time constant may still be
    /// rejected.
    ///
    /// # Errors
    /// [`OutOfRange`] with table and field as named in the file, and the allowed range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let refused = |field, value, lowest, highest, unit| Err(OutOfRange { field, value, lowest, highest, unit });
        self.check_schema()?;
        self.check_oscillations()?;
        let sample_time = SampleTime::from_rate(10_000.0)?;
        let checked = match self.extended().plain() {
            Some(plant) => plant.check(sample_time).map_err(|error| match error.field {
                "share" => OutOfRange { field: "relaxation.share", ..error },
                _ => OutOfRange { field: "relaxation.tau_s", ..error },
            }),
            None => self.extended().check(sample_time),
        };
        checked.map_err(|error| match error.field {
            "relaxation.share" if !self.modes.is_empty() => {
                OutOfRange { unit: "of a step, together with the weight of [[mode]]", ..error }
            }
            _ => error,
        })?;
        self.check_reading()?;
        self.check_range()?;
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

    /// Replaces a law of more points than the tick takes by one that follows it, and checks the spring as [`PlantFile::check`] does.
    fn for_tick(&mut self) -> Result<(), OutOfRange> {
        if let Some(law) = self.law.as_ref().filter(|law| law.voltage_v.len() > MAX_POINTS) {
            // The points are in order, and not too many.
            self.check_for_host()?;
            let (of_tick, off) = law.of_tick();
            if off > law_of_tick::MOST_OFF {
                let (lowest, highest) = (2.0, MAX_POINTS as f64);
                let unit = "points, or more that lines through 9 of them follow to 0.5 % of the largest; `vsj diagnose` takes any law";
                return Err(OutOfRange {
                    field: "law.voltage_v",
                    value: law.voltage_v.len() as f64,
                    lowest,
                    highest,
                    unit,
                });
            }
            self.law = Some(of_tick);
        }
        self.check()
    }

    /// Checks whether the spring can be simulated in double precision, which has no ranges of its own: signs, list lengths and
    /// orders only.
    ///
    /// # Errors
    /// [`OutOfRange`] with table and field as named in the file, and the allowed range.
    pub fn check_for_host(&self) -> Result<(), OutOfRange> {
        const ANY: f64 = f64::MAX;
        const POSITIVE: f64 = f64::MIN_POSITIVE;
        let refused = |field, value, lowest, highest, unit| Err(OutOfRange { field, value, lowest, highest, unit });
        self.check_schema()?;
        let Relaxation { share, tau_s, weights, tau_high_s, tau_high_at_v } = &self.relaxation;
        let some = |value: &Option<f64>| value.iter().copied().collect::<Vec<_>>();
        let (memory, law, leakage) = (self.memory.as_ref(), self.law.as_ref(), self.leakage.as_ref());
        let amplifier = self.amplifier.clone().unwrap_or_default();
        let of_memory = |of: fn(&Memory) -> &Vec<f64>| memory.map(of).cloned().unwrap_or_default();
        let of_law = |of: fn(&Law) -> &Vec<f64>| law.map(of).cloned().unwrap_or_default();
        let of_modes = |of: fn(&Mode) -> f64| self.modes.iter().map(of).collect::<Vec<f64>>();
        let of_leakage = |of: fn(&Leakage) -> f64| leakage.map(of).into_iter().collect::<Vec<f64>>();
        for (field, values, lowest, highest, unit) in [
            ("relaxation.share", vec![*share], -ANY, ANY, ""),
            ("relaxation.tau_s", tau_s.clone(), POSITIVE, ANY, "s"),
            ("relaxation.weights", weights.clone(), -ANY, ANY, ""),
            ("relaxation.tau_high_s", some(tau_high_s), POSITIVE, ANY, "s"),
            ("relaxation.tau_high_at_v", some(tau_high_at_v), POSITIVE, ANY, "V"),
            ("memory.thresholds_v", of_memory(|memory| &memory.thresholds_v), 0.0, ANY, "V"),
            ("memory.weights", of_memory(|memory| &memory.weights), -ANY, ANY, ""),
            ("law.voltage_v", of_law(|law| &law.voltage_v), 0.0, ANY, "V"),
            ("law.stiffness", of_law(|law| &law.stiffness), -ANY, ANY, "V"),
            ("leakage.share", of_leakage(|leakage| leakage.share), 0.0, 1.0, ""),
            ("leakage.tau_s", of_leakage(|leakage| leakage.tau_s), POSITIVE, ANY, "s"),
            ("mode.freq_hz", of_modes(|mode| mode.freq_hz), POSITIVE, ANY, "Hz"),
            ("mode.zeta", of_modes(|mode| mode.zeta), POSITIVE, 1.0 - f64::EPSILON, ""),
            ("mode.weight", of_modes(|mode| mode.weight), -ANY, ANY, ""),
            ("mode.rate_weight", of_modes(|mode| mode.rate_weight), -ANY, ANY, ""),
            ("amplifier.limit_v", some(&amplifier.limit_v), POSITIVE, ANY, "V"),
            ("amplifier.slew_v_per_s", some(&amplifier.slew_v_per_s), POSITIVE, ANY, "V/s"),
            ("amplifier.delay_s", some(&amplifier.delay_s), 0.0, ANY, "s"),
        ] {
            if let Some(&value) = values.iter().find(|value| !(lowest..=highest).contains(*value)) {
                return refused(field, value, lowest, highest, unit);
            }
        }
        self.check_reading()?;
        self.check_range()?;
        let lengths = |field, found: usize, expected: usize, unit| match found == expected {
            true => Ok(()),
            false => refused(field, found as f64, expected as f64, expected as f64, unit),
        };
        if self.modes.len() > Self::MOST_MODES {
            return refused("mode", self.modes.len() as f64, 0.0, Self::MOST_MODES as f64, "oscillations");
        }
        for (field, values) in [
            ("memory.thresholds_v", memory.map(|memory| &memory.thresholds_v)),
            ("law.voltage_v", law.map(|law| &law.voltage_v)),
        ] {
            if let Some(count) = values.map(Vec::len).filter(|count| *count > MOST_LISTED) {
                return refused(field, count as f64, 0.0, MOST_LISTED as f64, "values");
            }
        }
        let most = model::extended::lags::MAX_LAGS;
        if tau_s.is_empty() || tau_s.len() > most {
            return refused("relaxation.tau_s", tau_s.len() as f64, 1.0, most as f64, "time constants");
        }
        if tau_s.len() > 1 || !weights.is_empty() {
            lengths("relaxation.weights", weights.len(), tau_s.len(), "weights")?;
        }
        if let Some(Memory { thresholds_v, weights, .. }) = memory {
            lengths("memory.weights", weights.len(), thresholds_v.len(), "weights")?;
        }
        if let Some(Law { voltage_v, stiffness }) = law {
            if voltage_v.first() != Some(&0.0) || voltage_v.len() < 2 {
                return refused(
                    "law.voltage_v",
                    voltage_v.first().copied().unwrap_or(f64::NAN),
                    0.0,
                    0.0,
                    "V, where the law starts",
                );
            }
            if let Some(pair) = voltage_v.windows(2).find(|pair| pair[1] <= pair[0]) {
                return refused("law.voltage_v", pair[1], pair[0], ANY, "V");
            }
            lengths("law.stiffness", stiffness.len(), voltage_v.len(), "points")?;
        }
        Ok(())
    }

    /// The amplifier with the file's limit and slew where they are stricter.
    pub fn behind(&self, amplifier: model::Amplifier) -> model::Amplifier {
        let Some(Amplifier { limit_v, slew_v_per_s, .. }) = self.amplifier else { return amplifier };
        amplifier.limited_to(limit_v, slew_v_per_s)
    }

    /// The size in V of the five steps of the stair on this spring behind an amplifier: the report's 100 V, or less where the stair would
    /// end at more than twice the recorded limit, the end of the law or the highest voltage from which the spring was identified, or beyond
    /// the range of the amplifier, if the command is no voltage. Then its end is as far below as in the report, 500 of 700 V, and the step
    /// 1, 2 or 5 times a power of ten.
    pub fn stair_step_v(&self, amplifier: model::Amplifier) -> f64 {
        let recorded = self.amplifier.as_ref().and_then(|amplifier| amplifier.limit_v);
        let of_other_command = self.units.as_ref().and_then(UnitNames::other_command).map(|_| amplifier.max_v);
        let law_v = self.law.as_ref().and_then(|law| law.voltage_v.last().copied());
        let identified = |range: Range| if self.even { range.highest_v.max(-range.lowest_v) } else { range.highest_v };
        // Of a stair, which is above 0 V, a range below says nothing.
        let identified_v = self.range.map(identified).filter(|highest_v| *highest_v > 0.0);
        let own_v = recorded.into_iter().chain(law_v).chain(identified_v).fold(f64::INFINITY, f64::min);
        let range_v = of_other_command.unwrap_or(f64::INFINITY);
        let end_v = own_v.min(range_v);
        if end_v <= 0.0 || range_v >= 5.0 * STAIR_STEP_V && own_v >= 2.5 * STAIR_STEP_V * (1.0 - 1e-9) {
            return STAIR_STEP_V;
        }
        let most_v = end_v / 7.0 * (1.0 + 1e-9);
        let decade = 10f64.powf(most_v.log10().floor());
        [5.0, 2.0, 1.0].into_iter().map(|digit| digit * decade).find(|step| *step <= most_v).unwrap_or(decade)
    }

    /// Names of the file's effects that neither the tick nor its amplifier stage simulates.
    pub fn left_out(&self) -> Vec<String> {
        let delayed = self.amplifier.as_ref().is_some_and(|amplifier| amplifier.delay_s.is_some());
        let unmodelled =
            self.unmodelled.iter().flat_map(|table| table.keys().map(|key| key.escape_debug().to_string()));
        let even = self.even.then(|| "even".to_owned());
        let modes = (!self.modes.is_empty()).then(|| "mode".to_owned());
        let delay = delayed.then(|| "amplifier.delay_s".to_owned());
        delay.into_iter().chain(even).chain(modes).chain(unmodelled).collect()
    }

    /// The spring of a file called `name` in messages, if it is the plain one.
    ///
    /// # Errors
    /// [`crate::bad_input::BadInput`] for an extended spring.
    pub fn plain(&self, name: &str) -> Result<Plant> {
        match self.extended().plain() {
            Some(plain) => Ok(plain),
            None => bad_input!("{name}: an extended spring; expected [relaxation] with one share and tau_s only"),
        }
    }

    /// Formats the file as TOML.
    ///
    /// # Errors
    /// If `unmodelled` holds a value that TOML cannot represent.
    pub fn to_toml(&self) -> Result<String> {
        Ok(toml::to_string(self)?)
    }
}

/// Loads the report's spring for `paper`, or the plant file of that path, for the tick.
///
/// # Errors
/// [`crate::bad_input::BadInput`] with file, line, column and what was expected, also for values that [`PlantFile::check`]
/// rejects.
pub fn load(plant: &str) -> Result<PlantFile> {
    load_checked(plant, PlantFile::for_tick)
}

/// Loads like [`load`], for a simulation in double precision, which accepts every spring that passes
/// [`PlantFile::check_for_host`].
///
/// # Errors
/// [`crate::bad_input::BadInput`] with file, line, column and what was expected.
pub fn load_for_host(plant: &str) -> Result<PlantFile> {
    load_checked(plant, |file| file.check_for_host())
}

/// A check of a plant file's values, which may change them into such as the tick can hold.
type Check = fn(&mut PlantFile) -> Result<(), OutOfRange>;

fn load_checked(plant: &str, check: Check) -> Result<PlantFile> {
    if plant == "paper" {
        return Ok(Plant::PAPER.into());
    }
    parse_checked(plant, &text_of(plant)?, check)
}

fn text_of(plant: &str) -> Result<String> {
    read_text(Path::new(plant), MOST_MIB, "`paper` or a plant file")
}

/// Loads like [`load`], with the text of the file as it is; that of the report's spring is made.
///
/// # Errors
/// The errors of [`load`].
pub fn load_with_text(plant: &str) -> Result<(PlantFile, String)> {
    if plant == "paper" {
        let file = load(plant)?;
        let text = file.to_toml()?;
        return Ok((file, text));
    }
    let text = text_of(plant)?;
    Ok((parse(plant, &text)?, text))
}

/// Loads like [`load`], but accepts the plain spring only.
///
/// # Errors
/// The errors of [`load`], and [`crate::bad_input::BadInput`] for an extended spring.
pub fn load_plain(plant: &str) -> Result<Plant> {
    load(plant)?.plain(plant)
}

/// Parses the plant file `text`, called `name` in messages.
///
/// # Errors
/// The errors of [`load`].
pub fn parse(name: &str, text: &str) -> Result<PlantFile> {
    parse_checked(name, text, PlantFile::for_tick)
}

/// Parses like [`parse`], for a simulation in double precision, as [`load_for_host`] loads.
///
/// # Errors
/// The errors of [`load_for_host`].
pub fn parse_for_host(name: &str, text: &str) -> Result<PlantFile> {
    parse_checked(name, text, |file| file.check_for_host())
}

/// The unit of an error with the name of the command's unit where that takes the place of the volt.
fn shown_unit(file: &PlantFile, unit: &str) -> String {
    let command = file.units.as_ref().and_then(UnitNames::other_command);
    let per_volt = unit.strip_prefix('V').filter(|rest| !rest.starts_with(char::is_alphabetic));
    match (command, per_volt) {
        (Some(command), Some(rest)) => format!("{}{rest}", one_line(&excerpt(command))),
        _ => unit.to_owned(),
    }
}

fn parse_checked(name: &str, text: &str, check: Check) -> Result<PlantFile> {
    let mut file: PlantFile = toml::from_str(text).map_err(|error| {
        let (at, what) = (error.span().map_or(0, |span| span.start), error.message().replace('\n', ", "));
        let expected = "expected schema, [relaxation] share and tau_s, and the tables of a plant file";
        BadInput(format!("{}: {what}; {expected}", place::line_and_column(name, text, at)))
    })?;
    if let Some(names) = &file.units {
        names.units().map_err(|error| BadInput(format!("{name}, [units]: {error}")))?;
    }
    if let Err(error) = check(&mut file) {
        let at = place::of_field(text, error.field, error.value);
        // The position already shows the table.
        let field = error.field.rsplit('.').next().unwrap_or(error.field);
        let unit = shown_unit(&file, error.unit);
        bad_input!("{}: {}{unit}", place::line_and_column(name, text, at), OutOfRange { field, unit: "", ..error });
    }
    Ok(file)
}

#[cfg(test)]
mod tests;
