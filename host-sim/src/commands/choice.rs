//! Options whose value is one of a few names. Their enums belong to libraries without a dependency on clap.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use paper::dynamics::report::Model;
use paper::dynamics::zener::Changes;
use paper::joint::OuterEnd;
use simulation::schedule::Between;

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

/// `--between` of a schedule: the voltage between two rows of its file.
pub(crate) const BETWEEN: Choices<Between> = &[
    ("hold", "The earlier row's value holds until the next row", Between::Hold),
    ("linear", "Linear interpolation between the rows", Between::Linear),
];

/// `--input` of `vsj diagnose`: the commanded voltage between two rows of a record.
pub(crate) const INPUT: Choices<identify::Input> = &[
    ("hold", "The earlier row's voltage held until the next row", identify::Input::Hold),
    ("linear", "Linear interpolation between the rows", identify::Input::Linear),
    ("stair", "The report's stair, with its 0.1 s ramps", identify::Input::Stair),
];

/// `--input` of `vsj identify`: the commanded voltage between two rows of a record.
pub(crate) const RECORDED: Choices<identify::Input> = &[INPUT[0], INPUT[1]];

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
