//! Options whose value is one of a few names. Their enums belong to libraries without a dependency on clap.

use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use paper::dynamics::report::Model;
use paper::dynamics::zener::Changes;
use paper::joint::OuterEnd;
use simulation::control_loop::Controller;
use simulation::schedule::Between;
use vsj_fmu::{Kind, Version};

/// The values of an option: name on the command line, help text, value.
pub(crate) type Choices<T> = &'static [(&'static str, &'static str, T)];

/// Parses one of `choices` by its name; help and errors list the names.
pub(crate) fn one_of<T: Copy + Send + Sync>(choices: Choices<T>) -> impl TypedValueParser<Value = T> {
    let values = choices.iter().map(|&(name, help, _)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(values).try_map(|chosen| {
        let found = choices.iter().find(|(name, ..)| *name == chosen);
        found.map(|&(_, _, value)| value).ok_or("not one of the names")
    })
}

/// Parses a time in s, with or without its unit: `10`, `10s`, `2min`, `500ms`.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let number = text.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
    let unit_s = match text[number.len()..].trim() {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "min" => 60.0,
        "h" => 3600.0,
        unit => return Err(format!("unit `{unit}`: expected s, ms, min or h")),
    };
    let seconds = number.trim().parse::<f64>().ok().filter(|seconds| *seconds > 0.0);
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds * unit_s).ok());
    time.ok_or_else(|| "expected a positive time like 10, 10s or 2min".to_owned())
}

/// `--between` of a schedule: the voltage between two rows of its file.
pub(crate) const BETWEEN: Choices<Between> = &[
    ("hold", "The earlier row's value holds until the next row", Between::Hold),
    ("linear", "Linear interpolation between the rows", Between::Linear),
];

/// `--controller` of a controlled loop.
pub(crate) const CONTROLLER: Choices<Controller> = &[
    ("none", "No controller: the target is the voltage", Controller::None),
    ("paper", "The report's proportional-integral pre-compensator", Controller::Paper),
    (
        "fast",
        "Time-optimal: the end of the range until the target can be held, then the holding voltage",
        Controller::Fast,
    ),
    ("robust", "As fast as a spring allows that is known to within errors, see --known", Controller::Robust),
];

/// `--unit` of `vsj export fmu`: the parts of a unit.
pub(crate) const UNIT: Choices<Kind> = &[
    ("spring", "The spring alone: voltage in, stiffness out", Kind::Spring),
    ("controller", "The controller: target in, voltage out", Kind::Controller),
    ("both", "Both: target in, stiffness out", Kind::Both),
];

/// `--fmi` of `vsj export fmu`: the version of the standard.
pub(crate) const FMI: Choices<Version> = &[("2", "FMI 2.0", Version::Two), ("3", "FMI 3.0", Version::Three)];

/// `--input` of `vsj diagnose`: the commanded voltage between two rows of a record.
pub(crate) const INPUT: Choices<identify::Input> = &[
    ("hold", "The earlier row's voltage held until the next row", identify::Input::Hold),
    ("linear", "Linear interpolation between the rows", identify::Input::Linear),
    ("stair", "The report's stair, with its 0.1 s ramps", identify::Input::Stair),
];

/// `--effort` of `vsj diagnose`: how long causes are searched for.
pub(crate) const EFFORT: Choices<identify::Effort> = &[
    ("quick", "A quarter of the normal effort", identify::Effort::Quick),
    (
        "normal",
        "At most 2 s of CPU time for 2400 rows, 8 s for 10 000, 20 s for 100 000, up to twice that on a slow machine; up to five times as much up to 5000 rows where causes halve the error and more may be found",
        identify::Effort::Normal,
    ),
    ("thorough", "Ten times the normal effort", identify::Effort::Thorough),
];

/// The model of `vsj dynamics`.
pub(crate) const MODEL: Choices<Model> = &[
    ("zener", "Spring in series with a parallel spring and damper", Model::Zener),
    ("spring-damper", "Parallel spring and damper alone", Model::SpringDamper),
    ("analogue", "The electrical analogue of the Zener model, solved as a circuit", Model::Analogue),
    ("pi-plant", "The report's proportional-integral plant, its input the level as a voltage", Model::PiPlant),
];

/// `--changes` of `vsj dynamics`: the springs of the Zener model that follow the level.
pub(crate) const CHANGES: Choices<Changes> = &[
    ("k1", "The series spring: the whole change is instantaneous", Changes::K1),
    ("k2", "The damped spring: the whole change is delayed", Changes::K2),
    ("both", "Both in the same ratio: part of the change is instantaneous, as measured", Changes::Both),
];

/// `--outer-end` of `vsj joint`: the support of a spring's outer end.
pub(crate) const OUTER_END: Choices<OuterEnd> = &[
    ("supported", "Simply supported: it slides and turns in a slot", OuterEnd::Supported),
    ("clamped", "Clamped: it turns with the ring", OuterEnd::Clamped),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_in_seconds_unless_it_has_a_unit() {
        for (text, seconds) in [("10", 10.0), ("10s", 10.0), ("2min", 120.0), ("0.5 h", 1800.0), ("500ms", 0.5)] {
            assert_eq!(duration(text).map(|time| time.as_secs_f64()), Ok(seconds), "{text}");
        }
        for text in ["", "s", "-1", "0", "10 days", "nan", "inf", "1e300", "10m"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
