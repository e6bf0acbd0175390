//! The settings of an MCU as a TOML file, for `vsj link PORT settings FILE`. Only `schema` is required: what the file does not
//! name stays as it is built into the MCU's image. With all values of the report's image it is
//!
#![doc = concat!("```toml\n", include_str!("../../docs/settings.toml"), "```")]
//!
//! [`model::device`], [`model::Settings`], [`model::supervisor::Settings`] and [`model::Feedback`] have the meaning and the range
//! of each value.

mod trips;

use std::path::Path;

use anyhow::Result;
use link::{Controller, WireSettings};
use model::isolation::Causes;
use model::{OutOfRange, device};
use serde::{Deserialize, Serialize};

use crate::bad_input;
use crate::bad_input::BadInput;
use crate::bounded_file::read_text;
use crate::plant_file::place;

pub use trips::Trips;

/// Largest size of a settings file, in MiB.
const MOST_MIB: usize = 1;

/// A settings file, in the units that its keys name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SettingsFile {
    /// Version of the format: 1.
    pub schema: u32,
    /// Rate of the control tick, in Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<u32>,
    /// Pre-compensator, of those that the image contains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controller: Option<Name>,
    /// Gains of the controller `paper`.
    #[serde(default)]
    pub gains: Gains,
    /// Approach of the controller `fast`.
    #[serde(default)]
    pub approach: Approach,
    /// Margin of the controller `robust`.
    #[serde(default)]
    pub margin: Margin,
    /// Range and slew rate of the amplifier.
    #[serde(default)]
    pub amplifier: Amplifier,
    /// Stiffness sensor that corrects the estimate.
    #[serde(default)]
    pub sensor: Sensor,
    /// Limits of the supervision.
    #[serde(default)]
    pub supervision: Supervision,
    /// Times of the watchdogs.
    #[serde(default)]
    pub watchdogs: Watchdogs,
    /// What the naming of a cause does.
    #[serde(default)]
    pub isolation: Isolation,
    /// Errors of the stored model that are no fault for the isolation bank.
    #[serde(default)]
    pub tolerance: Tolerance,
    /// Adaptation of the running model to what the isolation bank names.
    #[serde(default)]
    pub adaptation: Adaptation,
}

/// Name of a pre-compensator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Name {
    /// No pre-compensator.
    None,
    /// The report's proportional-integral one.
    Paper,
    /// The time-optimal one.
    Fast,
    /// For a spring that is known to within errors.
    Robust,
}

/// A table of a settings file: optional keys with a documentation for each.
macro_rules! table {
    ($(#[$doc:meta])* $name:ident { $($(#[$key_doc:meta])* $key:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$key_doc])* #[serde(skip_serializing_if = "Option::is_none")] pub $key: Option<$type>,)*
        }
    };
}

table! {
    /// Gains of the proportional-integral pre-compensator.
    Gains {
        /// Proportional gain, in V/V.
        proportional: f64,
        /// Integral gain, in 1/s.
        integral_per_s: f64,
    }
}
table! {
    /// Approach of the time-optimal pre-compensator.
    Approach {
        /// Time constant of the last part of the way, in s.
        tau_s: f64,
    }
}
table! {
    /// How well the robust pre-compensator knows the spring, and what it may overshoot; all without a unit.
    Margin {
        /// Largest relative error of the time constants, both ways.
        time_constant: f64,
        /// Largest relative error of the instantaneous share, both ways.
        share: f64,
        /// Largest relative error of the gain, both ways.
        gain: f64,
        /// Overshoot that is allowed on any spring within the errors, as a part of the step.
        overshoot: f64,
        /// Part of a step by which all springs may fall back for a while, without a sensor; 0 if they must not.
        fall_back: f64,
    }
}
table! {
    /// The amplifier behind the converter.
    Amplifier {
        /// Voltage at the highest code of the converter, in V.
        full_scale_v: f64,
        /// Lowest voltage, in V.
        min_v: f64,
        /// Highest voltage, in V.
        max_v: f64,
        /// Fastest change of the voltage, in V/s; not limited without it.
        slew_v_per_s: f64,
    }
}
table! {
    /// The stiffness sensor.
    Sensor {
        /// Whether the sensor corrects the estimate; true if the table has another key.
        enabled: bool,
        /// Standard deviation of a reading, in V.
        noise_v: f64,
        /// Standard deviation with which the model's error wanders, in V per root second.
        model_uncertainty: f64,
        /// Shortest time constant of the correction, in s.
        fastest_s: f64,
        /// Time between two readings, in s.
        interval_s: f64,
        /// Age above which a reading is stale, in s.
        oldest_s: f64,
        /// Lowest reading, in V.
        lowest_v: f64,
        /// Highest reading, in V.
        highest_v: f64,
        /// Time constant with which the correction decays without the sensor, in s.
        fade_s: f64,
    }
}
table! {
    /// Limits of the supervision.
    Supervision {
        /// Longest silence of the host, in s.
        host_timeout_s: f64,
        /// Slope of the ramp after that, in V/s.
        ramp_v_per_s: f64,
        /// Number of missed ticks that are tolerated together.
        missed_ticks_allowed: u32,
        /// Time after which a missed tick is forgotten, in s.
        forget_missed_s: f64,
        /// Largest difference between the voltage monitor and the output, in V.
        monitor_tolerance_v: f64,
        /// Largest magnitude of the current monitor, in A.
        max_current_a: f64,
        /// Time for which a monitor may disagree while the output is enabled, in s.
        monitor_time_s: f64,
        /// Time for which a monitor may disagree while the output is disabled, in s.
        discharge_time_s: f64,
    }
}
table! {
    /// Times of the watchdogs.
    Watchdogs {
        /// Time without a tick after which the control task is stopped, in ms.
        hang_ms: u32,
        /// Time after which a task that does not check in is a fault, in ms.
        stall_ms: u32,
        /// Time after which the chip is reset, in ms.
        reset_ms: u32,
    }
}

table! {
    /// The bank that isolates faults with the stiffness sensor.
    Isolation {
        /// Causes that are a fault once they are named.
        trip_on_cause: Trips,
    }
}
table! {
    /// How well the stored model is known: half the widths of 95 % intervals, without a unit.
    Tolerance {
        /// Largest relative error of the time constant that is no fault, both ways.
        time_constant: f64,
        /// Largest relative error of the instantaneous share that is no fault, both ways.
        share: f64,
        /// Largest relative error of the gain that is no fault, both ways.
        gain: f64,
    }
}
table! {
    /// The model follows what the isolation bank has named, within bounds around the stored one; all but the rate without a unit.
    Adaptation {
        /// Whether the model adapts; true if the table has another key.
        enabled: bool,
        /// Largest relative deviation of the time constant, both ways.
        time_constant: f64,
        /// Largest relative deviation of the instantaneous share, both ways.
        share: f64,
        /// Largest relative deviation of the gain, both ways.
        gain: f64,
        /// Largest relative change of a parameter in a second, in 1/s.
        rate_per_s: f64,
        /// Largest half width of the 95 % interval of a parameter that is taken over, relative to it.
        precision: f64,
        /// Distance between lowest and highest voltage since the fault began, as a part of the range.
        excitation: f64,
    }
}

impl From<&WireSettings> for SettingsFile {
    /// A file with every value.
    fn from(wire: &WireSettings) -> Self {
        let [hang_ms, stall_ms, reset_ms] = wire.watchdogs_ms;
        let margin = wire.margin.unwrap_or(model::Margin::TYPICAL.values()).map(Some);
        let [time_constant, share, gain, overshoot, fall_back] = margin;
        let mut sensor = Sensor { enabled: Some(wire.sensor.is_some()), ..Sensor::default() };
        for (value, key) in wire.sensor.unwrap_or_default().into_iter().zip(sensor.values_mut()) {
            *key = wire.sensor.map(|_| value);
        }
        Self {
            schema: 1,
            rate_hz: Some(wire.rate_hz),
            controller: Some(match wire.controller {
                Controller::None => Name::None,
                Controller::Paper => Name::Paper,
                Controller::Fast => Name::Fast,
                Controller::Robust => Name::Robust,
            }),
            gains: Gains { proportional: Some(wire.proportional), integral_per_s: Some(wire.integral_per_s) },
            approach: Approach { tau_s: Some(wire.approach_s) },
            margin: Margin { time_constant, share, gain, overshoot, fall_back },
            amplifier: Amplifier {
                full_scale_v: Some(wire.full_scale_v),
                min_v: Some(wire.min_v),
                max_v: Some(wire.max_v),
                slew_v_per_s: wire.slew_v_per_s,
            },
            sensor,
            supervision: Supervision {
                host_timeout_s: Some(wire.host_timeout_s),
                ramp_v_per_s: Some(wire.ramp_v_per_s),
                missed_ticks_allowed: Some(wire.missed_ticks_allowed),
                forget_missed_s: Some(wire.forget_missed_s),
                monitor_tolerance_v: Some(wire.monitor_tolerance_v),
                max_current_a: Some(wire.max_current_a),
                monitor_time_s: Some(wire.monitor_time_s),
                discharge_time_s: Some(wire.discharge_time_s),
            },
            watchdogs: Watchdogs { hang_ms: Some(hang_ms), stall_ms: Some(stall_ms), reset_ms: Some(reset_ms) },
            isolation: Isolation { trip_on_cause: Some(Trips(Causes::from_bits(wire.trip_on_cause))) },
            tolerance: Tolerance::from(wire.tolerance.unwrap_or_default()),
            adaptation: Adaptation::from(wire.adaptation),
        }
    }
}

/// The values of keys, and those of `otherwise` for keys that the file does not have.
fn over<const N: usize>(keys: [Option<f64>; N], otherwise: [f64; N]) -> [f64; N] {
    std::array::from_fn(|index| keys[index].unwrap_or(otherwise[index]))
}

impl Sensor {
    /// The values in the order of [`model::Feedback::values`].
    fn values_mut(&mut self) -> [&mut Option<f64>; 8] {
        let Self { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s, .. } =
            self;
        [noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s]
    }

    /// The values of the sensor: those of the file, else the built-in ones, else those of a typical sensor.
    fn over(&self, built_in: Option<[f64; 8]>) -> Option<[f64; 8]> {
        if !self.enabled.unwrap_or(*self != Self::default() || built_in.is_some()) {
            return None;
        }
        Some(over(self.clone().values_mut().map(|key| *key), built_in.unwrap_or(model::Feedback::TYPICAL.values())))
    }
}

impl From<[f64; 3]> for Tolerance {
    fn from(values: [f64; 3]) -> Self {
        let [time_constant, share, gain] = values.map(Some);
        Self { time_constant, share, gain }
    }
}

impl Tolerance {
    /// The tolerance: the values of the file, else the built-in ones; `None` if each of them is 0.
    fn over(&self, built_in: Option<[f64; 3]>) -> Option<[f64; 3]> {
        let Self { time_constant, share, gain } = *self;
        Some(over([time_constant, share, gain], built_in.unwrap_or_default())).filter(|values| *values != [0.0; 3])
    }
}

impl From<Option<[f64; 6]>> for Adaptation {
    fn from(values: Option<[f64; 6]>) -> Self {
        let enabled = Some(values.is_some());
        let Some([time_constant, share, gain, rate_per_s, precision, excitation]) = values.map(|v| v.map(Some)) else {
            return Self { enabled, ..Self::default() };
        };
        Self { enabled, time_constant, share, gain, rate_per_s, precision, excitation }
    }
}

impl Adaptation {
    /// The adaptation: the values of the file, else the built-in ones, else the typical ones; `None` if nothing adapts.
    fn over(&self, built_in: Option<[f64; 6]>) -> Option<[f64; 6]> {
        let Self { enabled, time_constant, share, gain, rate_per_s, precision, excitation } = *self;
        let keys = [time_constant, share, gain, rate_per_s, precision, excitation];
        let enabled = enabled.unwrap_or(*self != Self::default() || built_in.is_some());
        enabled.then(|| over(keys, built_in.unwrap_or(model::adaptation::Settings::TYPICAL.values())))
    }
}

impl Margin {
    /// The margin: the values of the file, else the built-in ones, else the typical ones.
    fn over(&self, built_in: Option<[f64; 5]>) -> [f64; 5] {
        let Self { time_constant, share, gain, overshoot, fall_back } = *self;
        over([time_constant, share, gain, overshoot, fall_back], built_in.unwrap_or(model::Margin::TYPICAL.values()))
    }
}

impl SettingsFile {
    /// The settings to be sent: those of the file over the built-in ones.
    pub fn over(&self, built_in: &WireSettings) -> WireSettings {
        let Self { gains, approach, margin, amplifier, sensor, supervision, watchdogs, .. } = self;
        let [hang_ms, stall_ms, reset_ms] = built_in.watchdogs_ms;
        let controller = match self.controller {
            None => built_in.controller,
            Some(Name::None) => Controller::None,
            Some(Name::Paper) => Controller::Paper,
            Some(Name::Fast) => Controller::Fast,
            Some(Name::Robust) => Controller::Robust,
        };
        WireSettings {
            rate_hz: self.rate_hz.unwrap_or(built_in.rate_hz),
            controller,
            proportional: gains.proportional.unwrap_or(built_in.proportional),
            integral_per_s: gains.integral_per_s.unwrap_or(built_in.integral_per_s),
            approach_s: approach.tau_s.unwrap_or(built_in.approach_s),
            full_scale_v: amplifier.full_scale_v.unwrap_or(built_in.full_scale_v),
            min_v: amplifier.min_v.unwrap_or(built_in.min_v),
            max_v: amplifier.max_v.unwrap_or(built_in.max_v),
            slew_v_per_s: amplifier.slew_v_per_s.or(built_in.slew_v_per_s),
            sensor: sensor.over(built_in.sensor),
            host_timeout_s: supervision.host_timeout_s.unwrap_or(built_in.host_timeout_s),
            ramp_v_per_s: supervision.ramp_v_per_s.unwrap_or(built_in.ramp_v_per_s),
            missed_ticks_allowed: supervision.missed_ticks_allowed.unwrap_or(built_in.missed_ticks_allowed),
            forget_missed_s: supervision.forget_missed_s.unwrap_or(built_in.forget_missed_s),
            monitor_tolerance_v: supervision.monitor_tolerance_v.unwrap_or(built_in.monitor_tolerance_v),
            max_current_a: supervision.max_current_a.unwrap_or(built_in.max_current_a),
            monitor_time_s: supervision.monitor_time_s.unwrap_or(built_in.monitor_time_s),
            discharge_time_s: supervision.discharge_time_s.unwrap_or(built_in.discharge_time_s),
            watchdogs_ms: [
                watchdogs.hang_ms.unwrap_or(hang_ms),
                watchdogs.stall_ms.unwrap_or(stall_ms),
                watchdogs.reset_ms.unwrap_or(reset_ms),
            ],
            trip_on_cause: self.isolation.trip_on_cause.map_or(built_in.trip_on_cause, |trips| trips.0.bits()),
            margin: (controller == Controller::Robust).then(|| margin.over(built_in.margin)),
            tolerance: self.tolerance.over(built_in.tolerance),
            adaptation: self.adaptation.over(built_in.adaptation),
        }
    }

    /// Formats the file as TOML.
    ///
    /// # Errors
    /// Never for numbers.
    pub fn to_toml(&self) -> Result<String> {
        Ok(toml::to_string(self)?)
    }
}

/// A settings file and its text, in which a value is looked up that the check rejects.
#[derive(Clone, Debug)]
pub struct Source {
    name: String,
    text: String,
    file: SettingsFile,
}

impl Source {
    /// Reads a settings file.
    ///
    /// # Errors
    /// [`BadInput`] with file, line, column and what was expected.
    pub fn open(path: &Path) -> Result<Self> {
        Self::parse(&path.display().to_string(), &read_text(path, MOST_MIB, "a settings file")?)
    }

    /// Parses the settings file `text`, called `name` in messages.
    ///
    /// # Errors
    /// The errors of [`Source::open`].
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let file: SettingsFile = toml::from_str(text).map_err(|error| {
            let (at, what) = (error.span().map_or(0, |span| span.start), error.message().replace('\n', ", "));
            BadInput(format!(
                "{}: {what}; expected schema, rate_hz, controller, and [gains], [approach], [margin], [amplifier], [sensor], \
                 [supervision], [watchdogs], [isolation], [tolerance], [adaptation]; pins, converters, monitor scales and baud rate need another image",
                place::line_and_column(name, text, at)
            ))
        })?;
        let source = Self { name: name.to_owned(), text: text.to_owned(), file };
        if source.file.schema != 1 {
            let value = f64::from(source.file.schema);
            let unit = "as version of the format";
            return Err(source.error(&OutOfRange { field: "schema", value, lowest: 1.0, highest: 1.0, unit }));
        }
        Ok(source)
    }

    /// The values of the file.
    pub fn file(&self) -> &SettingsFile {
        &self.file
    }

    /// The file's settings over the built-in ones, checked as the MCU checks them, but for what its image contains.
    ///
    /// # Errors
    /// [`BadInput`] with file, line, column and the allowed range.
    pub fn over(&self, built_in: &WireSettings) -> Result<WireSettings> {
        match self.file.over(built_in).over(&device::Settings::PAPER) {
            Ok(settings) => {
                settings.check().and_then(|()| settings.check_adaptation()).map_err(|error| self.error(&error))?;
                // Without what the controller does not use, which the MCU does not keep.
                Ok(WireSettings::new(&settings))
            }
            Err(field) => bad_input!("{}: this program does not know this {field}", self.name),
        }
    }

    fn error(&self, error: &OutOfRange) -> anyhow::Error {
        let at = place::of_field(&self.text, &key(error.field), error.value);
        BadInput(format!("{}: {error}", place::line_and_column(&self.name, &self.text, at))).into()
    }
}

/// The key of a settings file with the value that a check calls `field`.
fn key(field: &str) -> String {
    let table = match field {
        "schema" | "rate_hz" | "controller" => return field.into(),
        "proportional_gain" => return "gains.proportional".into(),
        "integral_gain_per_s" => return "gains.integral_per_s".into(),
        "approach_s" => return "approach.tau_s".into(),
        _ if ["margin.", "tolerance.", "adaptation."].iter().any(|table| field.starts_with(table)) => {
            return field.into();
        }
        "full_scale_v" | "min_v" | "max_v" | "slew_v_per_s" => "amplifier",
        "hang_ms" | "stall_ms" | "reset_ms" => "watchdogs",
        "range_v" => return "amplifier.max_v".into(),
        "trip_on_cause" => "isolation",
        "noise_v" | "model_uncertainty" | "fastest_s" | "interval_s" | "oldest_s" | "lowest_v" | "highest_v"
        | "fade_s" => "sensor",
        _ => "supervision",
    };
    format!("{table}.{field}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMPLETE: &str = include_str!("../../docs/settings.toml");

    fn built_in() -> WireSettings {
        WireSettings::new(&device::Settings::PAPER)
    }

    fn over(text: &str) -> Result<WireSettings> {
        Source::parse("s.toml", text)?.over(&built_in())
    }

    #[test]
    fn the_documented_file_has_the_values_of_the_reports_image() {
        let source = Source::parse("settings.toml", COMPLETE).unwrap();
        assert_eq!(source.over(&built_in()).unwrap(), built_in());
        assert_eq!(*source.file(), SettingsFile::from(&built_in()));
    }

    #[test]
    fn a_file_without_values_is_what_is_built_in() {
        assert_eq!(over("schema = 1").unwrap(), built_in());
        let with_sensor = WireSettings { sensor: Some(model::Feedback::TYPICAL.values()), ..built_in() };
        let over = |text| Source::parse("s.toml", text).unwrap().over(&with_sensor).unwrap();
        assert_eq!(over("schema = 1"), with_sensor);
        assert_eq!(over("schema = 1\n[sensor]\nenabled = false"), built_in());
        let fade = |settings: WireSettings| settings.sensor.unwrap()[7];
        assert_eq!(fade(over("schema = 1\n[sensor]\nfade_s = 9")), 9.0);
    }

    #[test]
    fn a_margin_is_that_of_the_robust_controller_alone() {
        let margin = |text| over(text).unwrap().margin;
        assert_eq!(margin("schema = 1\ncontroller = \"robust\""), Some([0.05, 0.05, 0.0, 0.02, 0.0]));
        let share = "schema = 1\ncontroller = \"robust\"\n[margin]\nshare = 0.1";
        assert_eq!(margin(share), Some([0.05, 0.1, 0.0, 0.02, 0.0]));
        assert_eq!(margin("schema = 1\n[margin]\nshare = 0.1"), None, "the controller is `paper`");
        let robust = WireSettings { controller: Controller::Robust, margin: Some([0.2; 5]), ..built_in() };
        let over = |text| Source::parse("s.toml", text).unwrap().over(&robust).unwrap().margin;
        assert_eq!(over("schema = 1\n[margin]\nshare = 0.1"), Some([0.2, 0.1, 0.2, 0.2, 0.2]));
        assert_eq!(over("schema = 1\ncontroller = \"fast\""), None);
    }

    #[test]
    fn an_adaptation_is_on_if_its_table_has_a_key_and_keeps_what_the_table_does_not_name() {
        let sensor = "schema = 1\n[sensor]\nenabled = true\n";
        let adaptation = |text: &str| over(&format!("{sensor}{text}")).unwrap().adaptation;
        assert_eq!(adaptation(""), None);
        assert_eq!(adaptation("[adaptation]\nenabled = true"), Some([0.25, 0.25, 0.15, 0.05, 0.01, 0.1]));
        assert_eq!(adaptation("[adaptation]\ngain = 0.02"), Some([0.25, 0.25, 0.02, 0.05, 0.01, 0.1]));
        let adapts =
            WireSettings { sensor: Some(model::Feedback::TYPICAL.values()), adaptation: Some([0.1; 6]), ..built_in() };
        let over = |text| Source::parse("s.toml", text).unwrap().over(&adapts).unwrap().adaptation;
        assert_eq!(over("schema = 1"), Some([0.1; 6]));
        assert_eq!(over("schema = 1\n[adaptation]\nshare = 0.2"), Some([0.1, 0.2, 0.1, 0.1, 0.1, 0.1]));
        assert_eq!(over("schema = 1\n[adaptation]\nenabled = false"), None);
    }

    #[test]
    fn every_value_reads_the_same_after_it_was_written() {
        let values = [2.0, 3.0, 0.5, 2e-3, 0.02, -20.0, 700.0, 4.0];
        for wire in [
            built_in(),
            WireSettings { controller: Controller::Fast, approach_s: 0.25, slew_v_per_s: Some(1e4), ..built_in() },
            WireSettings { sensor: Some(values), controller: Controller::None, ..built_in() },
            WireSettings { controller: Controller::Robust, margin: Some([0.1, 0.05, 0.01, 0.03, 0.25]), ..built_in() },
            WireSettings { sensor: Some(values), trip_on_cause: 0x8001, ..built_in() },
            WireSettings { tolerance: Some([0.01, 0.02, 0.0]), ..built_in() },
            WireSettings { sensor: Some(values), adaptation: Some([0.1, 0.2, 0.05, 0.04, 0.02, 0.3]), ..built_in() },
        ] {
            let text = SettingsFile::from(&wire).to_toml().unwrap();
            assert_eq!(over(&text).unwrap(), wire, "{text}");
        }
    }

    #[test]
    fn an_error_names_file_line_and_what_was_expected() {
        for (text, expected) in [
            ("schema = 2", "s.toml, line 1, column 10: schema = 2 is not allowed: expected 1 as version of the format"),
            ("schema = 1\nrate_hz = 300", "s.toml, line 2, column 11: rate_hz = 300 is not allowed: expected 250 Hz"),
            (
                "schema = 1\n[gains]\nproportional = -1",
                "s.toml, line 3, column 16: proportional_gain = -1 is not allowed",
            ),
            (
                "schema = 1\n[amplifier]\nmax_v = 800",
                "s.toml, line 3, column 9: max_v = 800 is not allowed: expected 10 to 700 V",
            ),
            (
                "schema = 1\n[watchdogs]\nhang_ms = 5",
                "s.toml, line 3, column 11: hang_ms = 5 is not allowed: expected 8 to 1000 ms",
            ),
            (
                "schema = 1\n[supervision]\nramp_v_per_s = nan",
                "s.toml, line 3, column 16: ramp_v_per_s = NaN is not allowed",
            ),
            ("schema = 1\n[sensor]\nfade_s = 1e9", "s.toml, line 3, column 10: fade_s = 1000000000 is not allowed"),
            (
                "schema = 1\n[isolation]\ntrip_on_cause = [\"gain-error\"]",
                "s.toml, line 3, column 17: trip_on_cause = 1 is not allowed: expected 0 causes without a sensor",
            ),
            (
                "schema = 1\n[isolation]\ntrip_on_cause = [\"gain\"]",
                "s.toml, line 3, column 17: invalid value: string \"gain\", expected \"off\" or a list of gain-error, ",
            ),
            (
                "schema = 1\ncontroller = \"robust\"\n[margin]\nshare = 0.3",
                "s.toml, line 4, column 9: margin.share = 0.3 is not allowed: expected 0 to 0.25 of the model's",
            ),
            (
                "schema = 1\ncontroller = \"robust\"\n[margin]\novershoot = 0.5",
                "s.toml, line 4, column 13: margin.overshoot = 0.5 is not allowed: expected 0 to 0.2 of a step",
            ),
            (
                "schema = 1\n[tolerance]\ngain = 0.3",
                "s.toml, line 3, column 8: tolerance.gain = 0.3 is not allowed: expected 0 to 0.25 of the model's",
            ),
            (
                "schema = 1\n[adaptation]\nenabled = true",
                "s.toml, line 3, column 11: adaptation.enabled = 1 is not allowed: expected 0 without a sensor",
            ),
            (
                "schema = 1\n[sensor]\nenabled = true\n[adaptation]\nrate_per_s = 2",
                "s.toml, line 5, column 14: adaptation.rate_per_s = 2 is not allowed: expected 0.001 to 1 1/s",
            ),
            (
                "schema = 1\n[sensor]\nenabled = true\n[adaptation]\nexcitation = 0.0",
                "s.toml, line 5, column 14: adaptation.excitation = 0 is not allowed: expected 0.01 to 1 of the range",
            ),
            ("schema = 1\n[adaptation]\ntau = 0.1", "s.toml, line 3, column 1: unknown field `tau`"),
            ("schema = 1\n[margin]\ntau = 0.1", "s.toml, line 3, column 1: unknown field `tau`"),
            ("schema = 1\n[pins]\ndac = 4", "s.toml, line 2, column 2: unknown field `pins`"),
            ("schema = 1\ncontroller = 7", "s.toml, line 2, column 14:"),
            ("schema = 1\nrate_hz = -5", "s.toml, line 2, column 11:"),
        ] {
            let error = format!("{:#}", over(text).unwrap_err());
            assert!(error.starts_with(expected) && !error.contains('\n'), "{error}");
        }
        let error = format!("{:#}", over("schema = 1\n[pins]\n").unwrap_err());
        assert!(error.contains("pins, converters, monitor scales and baud rate need another image"), "{error}");
    }
}
